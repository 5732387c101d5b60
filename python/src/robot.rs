//! Robots from URDF and MJCF files.

use crate::arrays::Triple;
use crate::errors::bad_value;
use crate::handles::{PyAttachmentHandle, PyDeformableHandle, PyRigidBodyHandle};
use crate::world::World;
use foible_robots::{JointSolver, Robot, RobotBuilder, RobotError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rapier3d::math::Pose;
use std::path::PathBuf;
use std::sync::Arc;

/// A robot of a world: links, joints and soft parts by the names of its file.
///
/// Made by `World.add_robot`. What its names give are handles for ``world.rigid_bodies``, ``world.deformable_bodies`` and
/// ``world.attachments``.
#[pyclass(frozen, name = "Robot", module = "foible3d")]
pub struct PyRobot {
    world: Py<World>,
    robot: Arc<Robot>,
}

fn refused(error: RobotError) -> PyErr {
    bad_value(error.to_string())
}

#[pymethods]
impl World {
    /// Puts a robot from a file into the world: URDF, or MJCF (``.xml`` or ``.mjcf``), both with z upward, so set ``gravity`` to
    /// match. ``soft_parts`` is a TOML file of soft parts beside it (MJCF's own ``flexcomp`` elements are soft parts too).
    /// ``position`` [m] is where the file's origin is; ``multibody`` solves its joints in their coordinates, else by forces between free
    /// bodies; ``fixed_base`` holds the root. A soft part does not touch the link that carries it.
    /// It is saved with the world, and is among the ``robots`` of what is loaded.
    #[pyo3(signature = (file, *, soft_parts = None, position = Triple([0.0; 3]), multibody = true, fixed_base = false))]
    fn add_robot(
        slf: &Bound<'_, Self>,
        file: PathBuf,
        soft_parts: Option<PathBuf>,
        position: Triple,
        multibody: bool,
        fixed_base: bool,
    ) -> PyResult<PyRobot> {
        let is_mjcf = file.extension().is_some_and(|e| e == "xml" || e == "mjcf");
        let builder = if is_mjcf { RobotBuilder::mjcf(&file) } else { RobotBuilder::urdf(&file) };
        let solver = if multibody { JointSolver::Multibody } else { JointSolver::Impulse };
        let at = Pose::from_translation(position.finite("position")?);
        let mut builder = builder.joint_solver(solver).fixed_base(fixed_base).pose(at);
        if let Some(file) = soft_parts {
            builder = builder.soft_parts(file);
        }
        let robot = slf.get().detached(slf.py(), |inner| {
            let robot = builder.insert(&mut inner.physics, &mut inner.deformables)?;
            let robot = Arc::new(robot);
            inner.robots.push(robot.clone());
            Ok(robot)
        })?;
        Ok(PyRobot { world: slf.clone().unbind(), robot: robot.map_err(refused)? })
    }

    /// The robots that were put in by `add_robot`, in that order.
    #[getter]
    fn robots(slf: &Bound<'_, Self>) -> PyResult<Vec<PyRobot>> {
        let robots = slf.get().with(slf.py(), |inner| inner.robots.clone())?;
        Ok(robots.into_iter().map(|robot| PyRobot { world: slf.clone().unbind(), robot }).collect())
    }
}

#[pymethods]
impl PyRobot {
    /// Handles of the rigid bodies of its links, by name.
    #[getter]
    fn links<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let links = PyDict::new(py);
        for link in self.robot.links() {
            links.set_item(&link.name, PyRigidBodyHandle(link.body))?;
        }
        Ok(links)
    }

    /// Handles of its soft parts, by name.
    #[getter]
    fn parts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let parts = PyDict::new(py);
        for part in self.robot.parts() {
            parts.set_item(&part.name, PyDeformableHandle(part.body))?;
        }
        Ok(parts)
    }

    /// Handles of what attaches its soft parts to their links, by the name of the part; not of those that are free.
    #[getter]
    fn attachments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let attachments = PyDict::new(py);
        for part in self.robot.parts() {
            if let Some(handle) = part.attachment {
                attachments.set_item(&part.name, PyAttachmentHandle(handle))?;
            }
        }
        Ok(attachments)
    }

    /// Names of its joints that move along or about one axis.
    #[getter]
    fn joints(&self) -> Vec<String> {
        let moving = self.robot.joints().iter().filter(|joint| joint.axis.is_some());
        moving.map(|joint| joint.name.clone()).collect()
    }

    /// What its files say and was left out, or taken otherwise.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.robot.warnings().iter().map(ToString::to_string).collect()
    }

    /// Leads a joint to a position [m] or [rad], within its limits, with a stiffness [N/m, N m/rad] and a damping [N s/m,
    /// N m s/rad], and no more than the file's effort. Returns the target within the limits.
    fn set_motor_position(
        &self,
        py: Python<'_>,
        joint: &str,
        target: f32,
        stiffness: f32,
        damping: f32,
    ) -> PyResult<f32> {
        let set = |inner: &mut crate::world::Inner| {
            self.robot.set_motor_position(&mut inner.physics, joint, target, stiffness, damping)
        };
        self.world.get().with(py, set)?.map_err(refused)
    }

    /// Drives a joint with a velocity [m/s] or [rad/s].
    fn set_motor_velocity(&self, py: Python<'_>, joint: &str, target: f32, damping: f32) -> PyResult<()> {
        let set = |inner: &mut crate::world::Inner| {
            self.robot.set_motor_velocity(&mut inner.physics, joint, target, damping)
        };
        self.world.get().with(py, set)?.map_err(refused)
    }

    /// Greatest force [N] or moment [N m] of a joint's motor.
    fn set_motor_max_force(&self, py: Python<'_>, joint: &str, force: f32) -> PyResult<()> {
        let set = |inner: &mut crate::world::Inner| {
            self.robot.set_motor_max_force(&mut inner.physics, joint, force)
        };
        self.world.get().with(py, set)?.map_err(refused)
    }

    /// Names of the actuators of an MJCF file.
    #[getter]
    fn actuators(&self) -> Vec<String> {
        self.robot.actuators().iter().map(|actuator| actuator.name.clone()).collect()
    }

    /// Sets the control of an actuator, within its range, until the next; returns what is set.
    fn set_control(&self, py: Python<'_>, actuator: &str, control: f32) -> PyResult<f32> {
        let set =
            |inner: &mut crate::world::Inner| self.robot.set_control(&mut inner.physics, actuator, control);
        self.world.get().with(py, set)?.map_err(refused)
    }

    /// Where a joint is [m] or [rad].
    fn joint_position(&self, py: Python<'_>, joint: &str) -> PyResult<f32> {
        let inner = self.world.get().lock(py);
        self.robot.joint_position(&inner.physics, joint).map_err(refused)
    }

    fn __repr__(&self) -> String {
        let (links, parts) = (self.robot.links().len(), self.robot.parts().len());
        format!("Robot(links={links}, joints={}, parts={parts})", self.robot.joints().len())
    }
}
