//! Moving air around deformable bodies.

use crate::arrays::Triple;
use crate::deformable::PyDeformableBody;
use foible3d::DeformableWind;
use pyo3::prelude::*;

#[pymethods]
impl PyDeformableBody {
    /// Has air move past the body at a velocity [m/s]; still air brakes what moves. ``density`` in kg/m³; ``drag`` is the drag
    /// coefficient of a plate across the wind, ``friction`` that of one along it [–]. None takes the air away.
    #[pyo3(signature = (velocity, density = 1.2, drag = 1.2, friction = 0.01))]
    fn set_wind(
        &self,
        py: Python<'_>,
        velocity: Option<Triple>,
        density: f64,
        drag: f64,
        friction: f64,
    ) -> PyResult<()> {
        let wind = |velocity: Triple| {
            let mut wind = DeformableWind::new(velocity.real());
            (wind.density, wind.drag, wind.friction) = (density, drag, friction);
            wind
        };
        self.try_with(py, |body| body.set_wind(velocity.map(wind)))
    }
}
