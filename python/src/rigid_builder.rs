//! Builders of rigid bodies, after rapier's.

use crate::arrays::{Placed, Triple, not_negative, number};
use crate::enums::PyBodyType;
use crate::options::apply;
use crate::rigid::PyRigidBody;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rapier3d::dynamics::{LockedAxes, RigidBodyBuilder, RigidBodyType};

/// What a rigid body is made of.
///
/// Made by ``RigidBody.dynamic`` and the like. Every method returns a new builder; each may be given as a keyword argument as well:
/// ``RigidBody.dynamic(translation=(0, 1, 0))``.
#[pyclass(frozen, name = "RigidBodyBuilder", module = "foible3d")]
#[derive(Clone)]
pub struct PyRigidBodyBuilder(pub RigidBodyBuilder);

impl PyRigidBodyBuilder {
    fn new_with(&self, change: impl FnOnce(RigidBodyBuilder) -> RigidBodyBuilder) -> Self {
        Self(change(self.0.clone()))
    }

    fn build<'py>(
        py: Python<'py>,
        body_type: RigidBodyType,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Self>> {
        apply(Bound::new(py, Self(RigidBodyBuilder::new(body_type)))?, options, &[])
    }
}

#[pymethods]
impl PyRigidBodyBuilder {
    /// A body of this type.
    #[new]
    #[pyo3(signature = (body_type = PyBodyType::Dynamic))]
    fn new(body_type: PyBodyType) -> Self {
        Self(RigidBodyBuilder::new(body_type.into()))
    }

    /// Sets where it is [m].
    fn translation(&self, v: Triple) -> PyResult<Self> {
        let v = v.finite("translation")?;
        Ok(self.new_with(|b| b.translation(v)))
    }

    /// Sets how it is turned, as axis times angle [rad].
    fn rotation(&self, scaled_axis: Triple) -> PyResult<Self> {
        let angle = scaled_axis.finite("rotation")?;
        Ok(self.new_with(|b| b.rotation(angle)))
    }

    /// Sets where it is and how it is turned: a translation [m], and a quaternion (x, y, z, w).
    fn position(&self, p: Placed) -> PyResult<Self> {
        let pose = p.pose("position")?;
        Ok(self.new_with(|b| b.pose(pose)))
    }

    /// Sets its velocity [m/s].
    fn linvel(&self, v: Triple) -> PyResult<Self> {
        let v = v.finite("linvel")?;
        Ok(self.new_with(|b| b.linvel(v)))
    }

    /// Sets its angular velocity [rad/s].
    fn angvel(&self, v: Triple) -> PyResult<Self> {
        let v = v.finite("angvel")?;
        Ok(self.new_with(|b| b.angvel(v)))
    }

    /// Sets the damping of its velocity [1/s].
    fn linear_damping(&self, f: f64) -> PyResult<Self> {
        let f = not_negative("linear_damping", f)?;
        Ok(self.new_with(|b| b.linear_damping(f)))
    }

    /// Sets the damping of its angular velocity [1/s].
    fn angular_damping(&self, f: f64) -> PyResult<Self> {
        let f = not_negative("angular_damping", f)?;
        Ok(self.new_with(|b| b.angular_damping(f)))
    }

    /// Sets the factor on gravity [–].
    fn gravity_scale(&self, f: f64) -> PyResult<Self> {
        let f = number("gravity_scale", f, false)?;
        Ok(self.new_with(|b| b.gravity_scale(f)))
    }

    /// Adds a mass [kg] to that of its colliders, at its origin and without inertia.
    fn additional_mass(&self, m: f64) -> PyResult<Self> {
        let m = not_negative("additional_mass", m)?;
        Ok(self.new_with(|b| b.additional_mass(m)))
    }

    /// Sets whether it may fall asleep; it may if not told otherwise.
    fn can_sleep(&self, b: bool) -> Self {
        self.new_with(|builder| builder.can_sleep(b))
    }

    /// Sets whether it begins asleep.
    fn sleeping(&self, b: bool) -> Self {
        self.new_with(|builder| builder.sleeping(b))
    }

    /// Sets whether it is kept from passing through things in a step.
    fn ccd_enabled(&self, b: bool) -> Self {
        self.new_with(|builder| builder.ccd_enabled(b))
    }

    /// Sets whether it takes part in the simulation.
    fn enabled(&self, b: bool) -> Self {
        self.new_with(|builder| builder.enabled(b))
    }

    /// Sets along which of the world's axes x, y and z it may move.
    fn enabled_translations(&self, t: (bool, bool, bool)) -> Self {
        self.lock([
            (LockedAxes::TRANSLATION_LOCKED_X, t.0),
            (LockedAxes::TRANSLATION_LOCKED_Y, t.1),
            (LockedAxes::TRANSLATION_LOCKED_Z, t.2),
        ])
    }

    /// Sets about which of the world's axes x, y and z it may turn.
    fn enabled_rotations(&self, t: (bool, bool, bool)) -> Self {
        self.lock([
            (LockedAxes::ROTATION_LOCKED_X, t.0),
            (LockedAxes::ROTATION_LOCKED_Y, t.1),
            (LockedAxes::ROTATION_LOCKED_Z, t.2),
        ])
    }

    /// Sets a number of the user's own.
    fn user_data(&self, d: u128) -> Self {
        self.new_with(|b| b.user_data(d))
    }

    fn __repr__(&self) -> String {
        let body = self.0.build();
        format!("<RigidBodyBuilder: {:?} at {}>", body.body_type(), body.translation())
    }
}

impl PyRigidBodyBuilder {
    fn lock(&self, axes: [(LockedAxes, bool); 3]) -> Self {
        self.new_with(|b| {
            let mut locked = b.build().locked_axes();
            axes.into_iter().for_each(|(axis, is_free)| locked.set(axis, !is_free));
            b.locked_axes(locked)
        })
    }
}

#[pymethods]
impl PyRigidBody {
    /// A builder of a body that forces, contacts and joints move.
    #[staticmethod]
    #[pyo3(signature = (**options))]
    fn dynamic<'py>(
        py: Python<'py>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyRigidBodyBuilder>> {
        PyRigidBodyBuilder::build(py, RigidBodyType::Dynamic, options)
    }

    /// A builder of a body that does not move.
    #[staticmethod]
    #[pyo3(signature = (**options))]
    fn fixed<'py>(
        py: Python<'py>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyRigidBodyBuilder>> {
        PyRigidBodyBuilder::build(py, RigidBodyType::Fixed, options)
    }

    /// A builder of a body that is led by positions: ``set_next_kinematic_translation`` and the like.
    #[staticmethod]
    #[pyo3(signature = (**options))]
    fn kinematic_position_based<'py>(
        py: Python<'py>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyRigidBodyBuilder>> {
        PyRigidBodyBuilder::build(py, RigidBodyType::KinematicPositionBased, options)
    }

    /// A builder of a body that is led by velocities: ``linvel`` and ``angvel``.
    #[staticmethod]
    #[pyo3(signature = (**options))]
    fn kinematic_velocity_based<'py>(
        py: Python<'py>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyRigidBodyBuilder>> {
        PyRigidBodyBuilder::build(py, RigidBodyType::KinematicVelocityBased, options)
    }
}
