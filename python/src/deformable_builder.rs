//! Builders of deformable bodies: what is set on them.

use crate::arrays::{Placed, Triple, number, points, rows, vertices};
use crate::enums::{PyBodyType, PyCombineRule, PyFidelity, PyGroups, PyIntegrator, PySolver};
use crate::errors::{bad_value, raised, without_panic};
use crate::material::PyMaterial;
use foible3d::{DeformableBody, DeformableBodyBuilder, DeformableModel};
use pyo3::prelude::*;
use std::cell::{Cell, RefCell};
use std::sync::Arc;

/// What a deformable body is made of.
///
/// Made by ``DeformableBody.cuboid`` and the like. Every method returns a new builder; each may be given as a keyword argument as well,
/// with a tuple where it takes several: ``DeformableBody.cuboid((0.1, 0.1, 0.1), (4, 4, 4), translation=(0, 1, 0))``.
#[pyclass(frozen, name = "DeformableBodyBuilder", module = "foible3d")]
pub struct PyDeformableBuilder {
    model: Arc<DeformableModel>,
    /// What is set on the crate's builder: it cannot be given another model later, of fibres for one.
    changes: Vec<Change>,
    /// Vertices, or a function that tells them.
    pinned: Option<Py<PyAny>>,
}

type Change = Arc<dyn Fn(DeformableBodyBuilder) -> DeformableBodyBuilder + Send + Sync>;

/// The methods that take several arguments, as options.
pub const SPREAD: [&str; 2] = ["active_events", "region_material"];

impl PyDeformableBuilder {
    /// Of a model.
    pub fn of(model: DeformableModel) -> Self {
        Self { model: Arc::new(model), changes: Vec::new(), pinned: None }
    }

    fn copy(&self, py: Python<'_>) -> Self {
        let pinned = self.pinned.as_ref().map(|pinned| pinned.clone_ref(py));
        Self { model: self.model.clone(), changes: self.changes.clone(), pinned }
    }

    /// One with something more set on it.
    pub fn new_with(
        &self,
        py: Python<'_>,
        change: impl Fn(DeformableBodyBuilder) -> DeformableBodyBuilder + Send + Sync + 'static,
    ) -> Self {
        let mut copy = self.copy(py);
        copy.changes.push(Arc::new(change));
        copy
    }

    fn new_of(&self, py: Python<'_>, model: DeformableModel) -> Self {
        Self { model: Arc::new(model), ..self.copy(py) }
    }

    /// The body, with its pins.
    pub fn finish(&self, py: Python<'_>) -> PyResult<DeformableBody> {
        let (model, changes) = (&self.model, &self.changes);
        let build = || unpinned(model, changes).build();
        let mut body = py.detach(|| without_panic(build))?.map_err(raised)?;
        for vertex in self.pins(py, &body)? {
            body.pin(vertex).map_err(raised)?;
        }
        Ok(body)
    }

    /// The crate's builder, without pins.
    pub fn unpinned(&self) -> DeformableBodyBuilder {
        unpinned(&self.model, &self.changes)
    }

    /// Whether any vertex is to be pinned.
    pub fn has_pins(&self) -> bool {
        self.pinned.is_some()
    }

    /// The vertices of a body that are to be pinned.
    pub fn pins(&self, py: Python<'_>, body: &DeformableBody) -> PyResult<Vec<usize>> {
        let Some(pinned) = &self.pinned else { return Ok(Vec::new()) };
        let pinned = pinned.bind(py);
        let told = match pinned.is_callable() {
            true => pinned.call1((rows(py, crate::deformable::positions(body))?,))?,
            false => pinned.clone(),
        };
        vertices(&told, "pinned", body.vertex_count())
    }
}

fn unpinned(model: &Arc<DeformableModel>, changes: &[Change]) -> DeformableBodyBuilder {
    changes.iter().fold(DeformableBodyBuilder::model(model.clone()), |builder, change| change(builder))
}

/// Notes the places that `ask` asks about: the crate does so one at a time, users are told of all at once.
fn places(ask: impl FnOnce(&dyn Fn([f64; 3]))) -> Vec<[f64; 3]> {
    let noted = RefCell::new(Vec::new());
    ask(&|place| noted.borrow_mut().push(place));
    noted.into_inner()
}

#[pymethods]
impl PyDeformableBuilder {
    /// Sets the material.
    fn material(&self, py: Python<'_>, material: PyMaterial) -> Self {
        self.new_with(py, move |b| b.material(material.0))
    }

    /// Puts every element into a region: ``region`` is called with the middles of all elements in the rest shape, an array of
    /// shape (m, 3) [m], and returns a whole number for each.
    fn regions(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Self> {
        let middles = places(|note| {
            _ = self.model.painted(|middle| {
                note(middle);
                0
            });
        });
        let count = middles.len();
        let told: Vec<u32> = crate::arrays::list(&region.call1((rows(py, middles)?,))?, "regions")?;
        if told.len() != count {
            return Err(bad_value(format!("regions: {} numbers for {count} elements", told.len())));
        }
        let next = Cell::new(0);
        Ok(self.new_of(py, self.model.painted(|_| told[next.replace(next.get() + 1)])))
    }

    /// Puts muscle fibres into the tetrahedra: their direction in the rest shape, one vector for all or a function that is called
    /// with the middles of all tetrahedra, an array of shape (m, 3) [m], and returns directions, of shape (m, 3); where these are
    /// zero there are none. ``Material``'s ``fibre_modulus`` is their stiffness, ``DeformableBody.activation`` has them contract.
    fn fibres(&self, py: Python<'_>, direction: &Bound<'_, PyAny>) -> PyResult<Self> {
        let model = (*self.model).clone();
        if !direction.is_callable() {
            let along = direction.extract::<Triple>()?.finite("fibres")?.to_array().map(f64::from);
            return Ok(self.new_of(py, model.with_fibres(|_| along)));
        }
        let middles = places(|note| {
            _ = model.clone().with_fibres(|middle| {
                note(middle);
                [0.0; 3]
            });
        });
        let count = middles.len();
        let told = points(&direction.call1((rows(py, middles)?,))?, "fibres")?;
        if told.len() != count {
            return Err(bad_value(format!("fibres: {} vectors for {count} tetrahedra", told.len())));
        }
        let next = Cell::new(0);
        Ok(self.new_of(py, model.with_fibres(|_| told[next.replace(next.get() + 1)])))
    }

    /// Sets the direction of the warp in woven sheets (``Material``'s ``sheet``), projected on each triangle: one vector for all, or a
    /// function that is called with the middles of all triangles at rest, an array of shape (m, 3) [m], and returns directions, of
    /// shape (m, 3); where these are zero there is none.
    fn warp(&self, py: Python<'_>, direction: &Bound<'_, PyAny>) -> PyResult<Self> {
        if !direction.is_callable() {
            let along = direction.extract::<Triple>()?.finite("warp")?.to_array().map(f64::from);
            return Ok(self.new_of(py, self.model.with_warp(|_| along).map_err(raised)?));
        }
        let place = |v: u32| self.model.rest_position(v as usize);
        let middle = |(corners, _): ([u32; 3], u32)| {
            let [a, b, c] = corners.map(place);
            [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
        };
        let middles: Vec<[f64; 3]> = self.model.sheet_triangles().map(middle).collect();
        let count = middles.len();
        let told = points(&direction.call1((rows(py, middles)?,))?, "warp")?;
        if told.len() != count {
            return Err(bad_value(format!("warp: {} vectors for {count} triangles", told.len())));
        }
        let next = Cell::new(0);
        let model = self.model.with_warp(|_| told[next.replace(next.get() + 1)]);
        Ok(self.new_of(py, model.map_err(raised)?))
    }

    /// Gives a region a material of its own.
    fn region_material(&self, py: Python<'_>, region: u32, material: PyMaterial) -> Self {
        self.new_with(py, move |b| b.region_material(region, material.0))
    }

    /// Sets where the rest shape is put [m].
    fn translation(&self, py: Python<'_>, translation: Triple) -> Self {
        self.new_with(py, move |b| b.translation(translation.real()))
    }

    /// Sets how the rest shape is turned, as axis times angle [rad].
    fn rotation(&self, py: Python<'_>, scaled_axis: Triple) -> Self {
        self.new_with(py, move |b| b.rotation(scaled_axis.real()))
    }

    /// Sets where the rest shape is put and how it is turned: a translation [m], and a quaternion (x, y, z, w).
    fn position(&self, py: Python<'_>, pose: Placed) -> PyResult<Self> {
        let pose = pose.pose("position")?;
        Ok(self.new_with(py, move |b| b.pose(pose)))
    }

    /// Sets the initial velocity of the centre of mass [m/s].
    fn linvel(&self, py: Python<'_>, linvel: Triple) -> Self {
        self.new_with(py, move |b| b.linvel(linvel.real()))
    }

    /// Sets the initial angular velocity [rad/s].
    fn angvel(&self, py: Python<'_>, angvel: Triple) -> Self {
        self.new_with(py, move |b| b.angvel(angvel.real()))
    }

    /// Sets what moves the body.
    fn body_type(&self, py: Python<'_>, body_type: PyBodyType) -> Self {
        self.new_with(py, move |b| b.body_type(body_type.into()))
    }

    /// Pins vertices where they begin. Either their numbers, or a truth value for each vertex, or a function that is called
    /// with the positions of all vertices in the world, an array of shape (n, 3) [m], and returns one of these:
    /// ``pinned=lambda x: x[:, 1] > 0.99``.
    fn pinned(&self, py: Python<'_>, vertices: Py<PyAny>) -> Self {
        Self { pinned: Some(vertices), ..self.copy(py) }
    }

    /// Sets the factor on gravity [–].
    fn gravity_scale(&self, py: Python<'_>, scale: f64) -> PyResult<Self> {
        number("gravity_scale", scale, false)?;
        Ok(self.new_with(py, move |b| b.gravity_scale(scale)))
    }

    /// Sets whether the body takes part in the simulation.
    fn enabled(&self, py: Python<'_>, enabled: bool) -> Self {
        self.new_with(py, move |b| b.enabled(enabled))
    }

    /// Sets whether the body may fall asleep; it may if not told otherwise.
    fn can_sleep(&self, py: Python<'_>, can_sleep: bool) -> Self {
        self.new_with(py, move |b| b.can_sleep(can_sleep))
    }

    /// Sets whether the body collides with itself; it does not if not told otherwise.
    fn self_contact(&self, py: Python<'_>, self_contact: bool) -> Self {
        self.new_with(py, move |b| b.self_contact(self_contact))
    }

    /// Sets what the body collides with.
    fn collision_groups(&self, py: Python<'_>, groups: PyGroups) -> Self {
        self.new_with(py, move |b| b.collision_groups(groups.0))
    }

    /// Sets how friction combines with that of what it touches.
    fn friction_combine_rule(&self, py: Python<'_>, rule: PyCombineRule) -> Self {
        self.new_with(py, move |b| b.friction_combine_rule(rule.into()))
    }

    /// Sets how restitution combines with that of what it touches.
    fn restitution_combine_rule(&self, py: Python<'_>, rule: PyCombineRule) -> Self {
        self.new_with(py, move |b| b.restitution_combine_rule(rule.into()))
    }

    /// Sets the knobs of the solver to those of a preset.
    fn fidelity(&self, py: Python<'_>, fidelity: PyFidelity) -> Self {
        self.new_with(py, move |b| b.fidelity(fidelity.into()))
    }

    /// Sets how a step goes forward in time.
    fn integrator(&self, py: Python<'_>, integrator: PyIntegrator) -> Self {
        self.new_with(py, move |b| b.tune(|settings| settings.integrator = integrator.into()))
    }

    /// Sets how the elasticity is solved.
    fn solver(&self, py: Python<'_>, solver: PySolver) -> Self {
        self.new_with(py, move |b| b.tune(|settings| settings.solver = solver.into()))
    }

    /// Sets the limit of global iterations in a step.
    fn max_iterations(&self, py: Python<'_>, count: usize) -> Self {
        self.new_with(py, move |b| b.tune(|settings| settings.max_iterations = count))
    }

    /// Sets the fraction of the largest force below which residual forces end the iteration.
    fn tolerance(&self, py: Python<'_>, tolerance: f64) -> Self {
        self.new_with(py, move |b| b.tune(|settings| settings.tolerance = tolerance))
    }

    /// Sets the fraction of the largest contact force to which contact forces are solved.
    fn contact_tolerance(&self, py: Python<'_>, tolerance: f64) -> Self {
        self.new_with(py, move |b| b.tune(|settings| settings.contact_tolerance = tolerance))
    }

    /// Smooths the elements, so that nearly incompressible materials do not lock.
    #[pyo3(signature = (smoothed = true))]
    fn smoothed(&self, py: Python<'_>, smoothed: bool) -> Self {
        match smoothed {
            true => self.new_of(py, (*self.model).clone().smoothed()),
            false => self.copy(py),
        }
    }

    /// Sets a number of the user's own.
    fn user_data(&self, py: Python<'_>, data: u128) -> Self {
        self.new_with(py, move |b| b.user_data(data))
    }

    fn __repr__(&self) -> String {
        format!("<DeformableBodyBuilder: {} vertices>", self.model.vertex_count())
    }
}
