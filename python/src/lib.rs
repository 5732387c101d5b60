//! The extension module of the Python package `foible3d`: a world of its own, of rapier3d's rigid bodies and foible3d's
//! deformable ones, as two extension modules share no types of Rust's.
//!
//! | module | what it holds |
//! |---|---|
//! | `errors`, `arrays`, `options`, `enums`, `handles` | what goes between Python and Rust |
//! | `world`, `snapshots`, `counters`, `batch` | the world, its bytes, what a step did, many worlds |
//! | `bodies`, `sets` | putting things in and out, and finding them |
//! | `bulk` | arrays that are filled, all bodies at once |
//! | `rigid*`, `collider*`, `joint*` | rapier's |
//! | `material`, `deformable*`, `attachments`, `cables`, `contacts`, `events` | foible3d's |
//! | `wind`, `queries`, `recording` | air, rays, files |
//! | `tactile`, `depth_camera`, `wrench` | touch, as sensors report it |
//! | `actuators`, `signals` | what drives a world, by name |
//! | `tape`, `tape_loss`, `gradient` | gradients over steps |

mod actuators;
mod arrays;
mod attachments;
mod batch;
mod bodies;
mod bulk;
mod cables;
mod collider;
mod collider_builder;
mod contacts;
mod counters;
mod deformable;
mod deformable_builder;
mod deformable_cavities;
mod deformable_controls;
mod deformable_forces;
mod deformable_shapes;
mod depth_camera;
mod enums;
mod errors;
mod events;
mod gradient;
mod handles;
mod joint_builder;
mod joints;
mod material;
mod options;
mod queries;
mod recording;
mod rigid;
mod rigid_builder;
mod rigid_forces;
mod rigid_regions;
mod robot;
mod sets;
mod signals;
mod snapshots;
mod tactile;
mod tape;
mod tape_loss;
mod wind;
mod world;
mod wrench;

/// The compiled part of foible3d; import from ``foible3d``.
#[pyo3::pymodule(name = "_native")]
mod native {
    #[pymodule_export]
    use crate::actuators::{ActuatorSet, PySignal};
    #[pymodule_export]
    use crate::attachments::Attachment;
    #[pymodule_export]
    use crate::batch::step_all;
    #[pymodule_export]
    use crate::cables::{Cable, PyCablePoint};
    #[pymodule_export]
    use crate::collider::PyCollider;
    #[pymodule_export]
    use crate::collider_builder::PyColliderBuilder;
    #[pymodule_export]
    use crate::deformable::PyDeformableBody;
    #[pymodule_export]
    use crate::deformable_builder::PyDeformableBuilder;
    #[pymodule_export]
    use crate::depth_camera::PyDepthCamera;
    #[pymodule_export]
    use crate::enums::{
        PyBodyType, PyCombineRule, PyElasticity, PyFidelity, PyGroups, PyIntegrator, PyJointAxis,
        PyMotorModel, PySolver,
    };
    #[pymodule_export]
    use crate::events::{PyCollisionEvent, PyContactForceEvent};
    #[pymodule_export]
    use crate::gradient::PyGradient;
    #[pymodule_export]
    use crate::handles::{
        PyAttachmentHandle, PyCableHandle, PyColliderHandle, PyDeformableHandle, PyJointHandle,
        PyRigidBodyHandle,
    };
    #[pymodule_export]
    use crate::joint_builder::{FixedJoint, PrismaticJoint, PyJointBuilder, RevoluteJoint, SphericalJoint};
    #[pymodule_export]
    use crate::joints::PyJoint;
    #[pymodule_export]
    use crate::material::PyMaterial;
    #[pymodule_export]
    use crate::queries::PySurfacePoint;
    #[pymodule_export]
    use crate::recording::PyReplay;
    #[pymodule_export]
    use crate::rigid::PyRigidBody;
    #[pymodule_export]
    use crate::rigid_builder::PyRigidBodyBuilder;
    #[pymodule_export]
    use crate::rigid_regions::PyRigidRegion;
    #[pymodule_export]
    use crate::robot::PyRobot;
    #[pymodule_export]
    use crate::sets::{
        AttachmentSet, CableSet, ColliderSet, DeformableBodySet, ImpulseJointSet, RigidBodySet,
    };
    #[pymodule_export]
    use crate::signals::{PyActuator, PyMotorAxis};
    #[pymodule_export]
    use crate::tactile::{PyTactilePad, PyTactileReading};
    #[pymodule_export]
    use crate::tape::PyTape;
    #[pymodule_export]
    use crate::world::World;

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name that Python has for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    #[pymodule_init]
    fn load() {
        crate::batch::note_process();
    }
}
