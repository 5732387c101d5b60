//! Materials of deformable bodies.

use crate::enums::PyElasticity;
use crate::errors::{bad_value, raised};
use foible3d::{DeformableMaterial, MaxwellBranch, OrthotropicSheet};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// What a deformable body is made of, in SI units. What is typed is what is got, at any mesh and step.
///
/// ``youngs_modulus``: Young's modulus [Pa]. ``poisson_ratio``: Poisson's ratio [–], 0 up to 0.4999. ``density`` [kg/m³]. ``friction``: coefficient of
/// friction [–]. ``restitution``: coefficient of restitution [–]. ``mass_damping``: damping by mass [1/s]. ``stiffness_damping``: damping by
/// stiffness [s]. ``elasticity``: the elastic energy. ``strain_limits``: least and largest principal stretch [–], or None.
/// ``fibre_modulus``: Young's modulus of muscle fibres [Pa]. ``maxwell_branches``: up to four pairs (ratio [–], time [s]) of springs that give way.
/// ``hard_strain_limits``: least and largest stretch with which a step may end [–], or None. ``sheet``: of woven sheets Young's moduli along the
/// warp and the weft [Pa], Poisson's ratio of a pull along the warp, and the shear modulus [Pa], or None; they need a ``warp`` of the body.
#[pyclass(frozen, eq, from_py_object, name = "Material", module = "foible3d")]
#[derive(Clone, Copy, PartialEq)]
pub struct PyMaterial(pub DeformableMaterial);

#[pymethods]
impl PyMaterial {
    /// A material; raises `DeformableBodyError` if something is out of its range.
    #[new]
    #[pyo3(signature = (youngs_modulus, poisson_ratio, *, density = 1000.0, friction = 0.5, restitution = 0.0, mass_damping = 0.0,
        stiffness_damping = 0.0, elasticity = PyElasticity::LinearCorotated, strain_limits = None, fibre_modulus = 0.0,
        maxwell_branches = Vec::new(), hard_strain_limits = None, sheet = None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn new(
        youngs_modulus: f64,
        poisson_ratio: f64,
        density: f64,
        friction: f64,
        restitution: f64,
        mass_damping: f64,
        stiffness_damping: f64,
        elasticity: PyElasticity,
        strain_limits: Option<(f64, f64)>,
        fibre_modulus: f64,
        maxwell_branches: Vec<(f64, f64)>,
        hard_strain_limits: Option<(f64, f64)>,
        sheet: Option<(f64, f64, f64, f64)>,
    ) -> PyResult<Self> {
        let mut material = DeformableMaterial::new(youngs_modulus, poisson_ratio)
            .density(density)
            .friction(friction)
            .restitution(restitution)
            .mass_damping(mass_damping)
            .stiffness_damping(stiffness_damping)
            .elasticity(elasticity.into())
            .fibre_modulus(fibre_modulus);
        material.strain_limits = strain_limits.map(<[f64; 2]>::from);
        material.hard_strain_limits = hard_strain_limits.map(<[f64; 2]>::from);
        material.orthotropic = sheet.map(|(warp_modulus, weft_modulus, poisson_ratio, shear_modulus)| {
            OrthotropicSheet { warp_modulus, weft_modulus, poisson_ratio, shear_modulus }
        });
        let most = material.maxwell_branches.len();
        if maxwell_branches.len() > most {
            let given = maxwell_branches.len();
            return Err(bad_value(format!("material: {given} Maxwell branches, but at most {most}")));
        }
        for (own, (ratio, time)) in material.maxwell_branches.iter_mut().zip(maxwell_branches) {
            *own = MaxwellBranch { ratio, time };
        }
        Self::checked(material)
    }

    /// Woven cloth: Young's moduli along the warp and the weft [Pa], Poisson's ratio of a pull along the warp, and the shear modulus
    /// [Pa]. The bodies it is given to need a ``warp``. Young's modulus is then that of bending.
    #[staticmethod]
    fn orthotropic_sheet(
        warp_modulus: f64,
        weft_modulus: f64,
        poisson_ratio: f64,
        shear_modulus: f64,
    ) -> PyResult<Self> {
        Self::checked(DeformableMaterial::orthotropic_sheet(
            warp_modulus,
            weft_modulus,
            poisson_ratio,
            shear_modulus,
        ))
    }

    /// Rubber of this Shore A hardness, 20 to 80; ``smoothed`` elements suit it.
    #[staticmethod]
    fn shore_a(hardness: f64) -> PyResult<Self> {
        Self::checked(DeformableMaterial::shore_a(hardness))
    }

    /// The silicone Sylgard 184 (PDMS), cured at 25 °C.
    #[staticmethod]
    fn sylgard_184() -> Self {
        Self(DeformableMaterial::sylgard_184())
    }

    /// The silicone Ecoflex 00-30, neo-Hookean, as rubbers below: 29.7 kPa at twice its length.
    #[staticmethod]
    fn ecoflex_00_30() -> Self {
        Self(DeformableMaterial::ecoflex_00_30())
    }

    /// The silicone Ecoflex 00-50: 41 kPa at twice its length.
    #[staticmethod]
    fn ecoflex_00_50() -> Self {
        Self(DeformableMaterial::ecoflex_00_50())
    }

    /// The silicone Dragon Skin 10 Medium: 113 kPa at twice its length.
    #[staticmethod]
    fn dragon_skin_10() -> Self {
        Self(DeformableMaterial::dragon_skin_10())
    }

    /// The silicone Dragon Skin 20: 318 kPa at twice its length.
    #[staticmethod]
    fn dragon_skin_20() -> Self {
        Self(DeformableMaterial::dragon_skin_20())
    }

    /// The silicone Dragon Skin 30: 437 kPa at twice its length.
    #[staticmethod]
    fn dragon_skin_30() -> Self {
        Self(DeformableMaterial::dragon_skin_30())
    }

    /// Natural rubber without filler: 0.53 MPa at twice its length.
    #[staticmethod]
    fn natural_rubber() -> Self {
        Self(DeformableMaterial::natural_rubber())
    }

    /// The thermoplastic polyurethane Texin 245, 43 Shore D.
    #[staticmethod]
    fn texin_245() -> Self {
        Self(DeformableMaterial::texin_245())
    }

    /// Healthy human liver in the body, for small strains.
    #[staticmethod]
    fn liver() -> Self {
        Self(DeformableMaterial::liver())
    }

    /// The closed-cell polyethylene foam Plastazote LD33.
    #[staticmethod]
    fn plastazote_ld33() -> Self {
        Self(DeformableMaterial::plastazote_ld33())
    }

    /// The same with other values of some quantities, by the names of the constructor.
    #[pyo3(signature = (**changes))]
    fn replace<'py>(
        slf: &Bound<'py, Self>,
        changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let all = slf.get().quantities(slf.py())?;
        if let Some(changes) = changes {
            all.update(changes.as_mapping())?;
        }
        slf.get_type().call((), Some(&all))
    }

    /// Young's modulus [Pa].
    #[getter]
    fn youngs_modulus(&self) -> f64 {
        self.0.youngs_modulus
    }

    /// Poisson's ratio [–].
    #[getter]
    fn poisson_ratio(&self) -> f64 {
        self.0.poisson_ratio
    }

    /// Density [kg/m³].
    #[getter]
    fn density(&self) -> f64 {
        self.0.density
    }

    /// Coefficient of friction [–].
    #[getter]
    fn friction(&self) -> f64 {
        self.0.friction
    }

    /// Coefficient of restitution [–].
    #[getter]
    fn restitution(&self) -> f64 {
        self.0.restitution
    }

    /// Damping by mass [1/s].
    #[getter]
    fn mass_damping(&self) -> f64 {
        self.0.mass_damping
    }

    /// Damping by stiffness [s].
    #[getter]
    fn stiffness_damping(&self) -> f64 {
        self.0.stiffness_damping
    }

    /// The elastic energy.
    #[getter]
    fn elasticity(&self) -> Option<PyElasticity> {
        PyElasticity::of(self.0.elasticity)
    }

    /// Least and largest principal stretch [–], or None.
    #[getter]
    fn strain_limits(&self) -> Option<(f64, f64)> {
        self.0.strain_limits.map(Into::into)
    }

    /// Young's modulus of muscle fibres [Pa].
    #[getter]
    fn fibre_modulus(&self) -> f64 {
        self.0.fibre_modulus
    }

    /// Pairs of ratio [–] and time [s] of springs that give way.
    #[getter]
    fn maxwell_branches(&self) -> Vec<(f64, f64)> {
        let branches = self.0.maxwell_branches.iter().filter(|branch| branch.ratio > 0.0);
        branches.map(|branch| (branch.ratio, branch.time)).collect()
    }

    /// Least and largest stretch with which a step may end [–], or None.
    #[getter]
    fn hard_strain_limits(&self) -> Option<(f64, f64)> {
        self.0.hard_strain_limits.map(Into::into)
    }

    /// Constants of woven sheets, or None.
    #[getter]
    fn sheet(&self) -> Option<(f64, f64, f64, f64)> {
        let own = self.0.orthotropic?;
        Some((own.warp_modulus, own.weft_modulus, own.poisson_ratio, own.shear_modulus))
    }

    fn __repr__(&self) -> String {
        let m = &self.0;
        format!(
            "Material(youngs_modulus={}, poisson_ratio={}, density={}, friction={}, restitution={}, mass_damping={}, \
             stiffness_damping={}, ...)",
            m.youngs_modulus,
            m.poisson_ratio,
            m.density,
            m.friction,
            m.restitution,
            m.mass_damping,
            m.stiffness_damping
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let all = slf.get().quantities(slf.py())?;
        let call = slf.py().import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&all))?;
        Ok((call, PyTuple::empty(slf.py())))
    }
}

impl PyMaterial {
    fn checked(material: DeformableMaterial) -> PyResult<Self> {
        material.validate().map_err(raised)?;
        Ok(Self(material))
    }

    /// The keyword arguments that make this material.
    fn quantities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        macro_rules! tell {
            ($($name:ident)*) => { $(all.set_item(stringify!($name), self.$name())?;)* };
        }
        tell!(youngs_modulus poisson_ratio density friction restitution mass_damping stiffness_damping elasticity
            strain_limits fibre_modulus maxwell_branches hard_strain_limits sheet);
        Ok(all)
    }
}
