//! Choices among a few names, and collision groups.

use foible3d::{Elasticity, Fidelity, Integrator, Solver};
use pyo3::prelude::*;
use rapier3d::dynamics::{CoefficientCombineRule, JointAxis, MotorModel, RigidBodyType};
use rapier3d::geometry::{Group, InteractionGroups, InteractionTestMode};

macro_rules! choices {
    ($(#[$doc:meta])* $name:ident = $python:literal of $of:ident {
        $(#[doc = $vdoc:literal] $variant:ident = $shown:literal,)*
    }) => {
        $(#[$doc])*
        #[doc = ""]
        $(#[doc = concat!("- ``", $shown, "``:", $vdoc)])*
        #[pyclass(frozen, eq, eq_int, hash, from_py_object, name = $python, module = "foible3d")]
        #[derive(Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name {
            $(#[doc = $vdoc] #[pyo3(name = $shown)] $variant,)*
        }

        impl From<$name> for $of {
            fn from(choice: $name) -> Self {
                match choice {
                    $($name::$variant => $of::$variant,)*
                }
            }
        }

        impl $name {
            /// The one of rapier's or the crate's.
            #[allow(dead_code, unreachable_patterns)]
            pub fn of(choice: $of) -> Option<Self> {
                match choice {
                    $($of::$variant => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }

        #[pymethods]
        impl $name {
            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyAny>, &'static str))> {
                let name = match *slf.get() {
                    $(Self::$variant => $shown,)*
                };
                let getattr = slf.py().import("builtins")?.getattr("getattr")?;
                Ok((getattr, (slf.as_any().get_type().into_any(), name)))
            }
        }
    };
}

choices! {
    /// What moves a body.
    PyBodyType = "RigidBodyType" of RigidBodyType {
        /// Forces, contacts and joints.
        Dynamic = "DYNAMIC",
        /// Nothing.
        Fixed = "FIXED",
        /// The positions that its user sets for the next step.
        KinematicPositionBased = "KINEMATIC_POSITION_BASED",
        /// The velocities that its user sets.
        KinematicVelocityBased = "KINEMATIC_VELOCITY_BASED",
    }
}

choices! {
    /// How coefficients of two things that touch combine.
    PyCombineRule = "CoefficientCombineRule" of CoefficientCombineRule {
        /// Their mean.
        Average = "AVERAGE",
        /// The smaller.
        Min = "MIN",
        /// Their product.
        Multiply = "MULTIPLY",
        /// The larger.
        Max = "MAX",
        /// Their sum, at most one.
        ClampedSum = "CLAMPED_SUM",
        /// The root of their product.
        GeometricMean = "GEOMETRIC_MEAN",
    }
}

choices! {
    /// An axis of a joint, in the frame of its first body.
    PyJointAxis = "JointAxis" of JointAxis {
        /// Along x.
        LinX = "LIN_X",
        /// Along y.
        LinY = "LIN_Y",
        /// Along z.
        LinZ = "LIN_Z",
        /// About x.
        AngX = "ANG_X",
        /// About y.
        AngY = "ANG_Y",
        /// About z.
        AngZ = "ANG_Z",
    }
}

choices! {
    /// What the stiffness and damping of a joint's motor are per.
    PyMotorModel = "MotorModel" of MotorModel {
        /// Per unit of mass: rapier's default.
        AccelerationBased = "ACCELERATION_BASED",
        /// In N/m and N s/m, or N m/rad and N m s/rad.
        ForceBased = "FORCE_BASED",
    }
}

choices! {
    /// How much truth a deformable body is solved for.
    PyFidelity = "Fidelity" of Fidelity {
        /// One iteration: motion that looks right.
        Preview = "PREVIEW",
        /// Nearly the defaults.
        Game = "GAME",
        /// A hundredth of the error of `GAME`.
        Engineering = "ENGINEERING",
        /// Until little but rounding is left.
        Reference = "REFERENCE",
    }
}

choices! {
    /// The elastic energy of a material.
    PyElasticity = "Elasticity" of Elasticity {
        /// Exactly linear elasticity at small strain, under any rotation: the default.
        LinearCorotated = "LINEAR_COROTATED",
        /// The two constraints of Projective Dynamics.
        Projective = "PROJECTIVE",
        /// As the linear one, with the volume itself in the place of its linear part.
        FixedCorotated = "FIXED_COROTATED",
        /// Rubber at large strain.
        NeoHookean = "NEO_HOOKEAN",
    }
}

choices! {
    /// How the elasticity of a body is solved.
    PySolver = "Solver" of Solver {
        /// Projective Dynamics, the default of solids.
        Projective = "PROJECTIVE",
        /// The same matrix by conjugate gradients.
        ConjugateGradients = "CONJUGATE_GRADIENTS",
        /// A sweep of Gauss–Seidel over it.
        GaussSeidel = "GAUSS_SEIDEL",
        /// Extended position-based dynamics.
        Xpbd = "XPBD",
        /// The diagonal that bounds it.
        Jacobi = "JACOBI",
        /// Newton's method, the default of ropes and small sheets.
        Newton = "NEWTON",
        /// Newton's method for what hangs untouched or settles, else Projective Dynamics: the default of large sheets.
        Automatic = "AUTOMATIC",
    }
}

choices! {
    /// How a step of a deformable body goes forward in time.
    PyIntegrator = "Integrator" of Integrator {
        /// First order, damps fast motion: the default.
        ImplicitEuler = "IMPLICIT_EULER",
        /// Second order: keeps vibrations and bounces.
        Bdf2 = "BDF2",
    }
}

/// Which groups something is in (`memberships`), and which it collides with (`filter`), 32 bits each.
///
/// Two things collide if each is in a group that the filter of the other has.
#[pyclass(frozen, eq, from_py_object, name = "InteractionGroups", module = "foible3d")]
#[derive(Clone, Copy, PartialEq)]
pub struct PyGroups(pub InteractionGroups);

#[pymethods]
impl PyGroups {
    /// Groups of these bits; all of them unless told otherwise.
    #[new]
    #[pyo3(signature = (memberships = u32::MAX, filter = u32::MAX))]
    fn new(memberships: u32, filter: u32) -> Self {
        let groups = [memberships, filter].map(Group::from_bits_retain);
        Self(InteractionGroups::new(groups[0], groups[1], InteractionTestMode::And))
    }

    /// In all groups, and colliding with all.
    #[staticmethod]
    fn all() -> Self {
        Self(InteractionGroups::all())
    }

    /// In no group, and colliding with none.
    #[staticmethod]
    fn none() -> Self {
        Self(InteractionGroups::none())
    }

    /// The groups it is in, as bits.
    #[getter]
    fn memberships(&self) -> u32 {
        self.0.memberships.bits()
    }

    /// The groups it collides with, as bits.
    #[getter]
    fn filter(&self) -> u32 {
        self.0.filter.bits()
    }

    fn __repr__(&self) -> String {
        format!("InteractionGroups(memberships={:#x}, filter={:#x})", self.memberships(), self.filter())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (u32, u32)) {
        (slf.get_type().into_any(), (slf.get().memberships(), slf.get().filter()))
    }
}
