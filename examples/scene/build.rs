//! A scene file turned into a rapier world and a deformable one.

use super::control::Motored;
use super::file::{self, Body, JointKind, Kind, Quantity, Scene, Shape};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::path::Path;

/// A running scene, with the names its file gives to things.
pub struct Stage {
    pub physics: PhysicsWorld,
    pub world: DeformableWorld,
    pub rigid: Vec<(String, RigidBodyHandle, ColliderHandle)>,
    pub deformable: Vec<(String, DeformableBodyHandle)>,
    pub probes: Vec<(String, DeformableBodyHandle, usize)>,
    /// Joints with a motor, in the order of the file.
    pub motors: Vec<Motored>,
}

pub fn build(scene: &Scene, folder: &Path) -> Result<Stage, String> {
    let mut physics = PhysicsWorld::new();
    physics.gravity = scene.world.gravity.into();
    physics.integration_parameters.dt = *scene.world.dt.as_ref();
    if let Some(iterations) = scene.world.iterations {
        physics.integration_parameters.num_solver_iterations = iterations.max(1);
    }
    let mut stage = Stage {
        physics,
        world: DeformableWorld::new(),
        rigid: Vec::new(),
        deformable: Vec::new(),
        probes: Vec::new(),
        motors: Vec::new(),
    };
    for body in &scene.rigid {
        let name = body.name.as_ref().clone();
        let builder = match body.kind {
            Kind::Fixed => RigidBodyBuilder::fixed(),
            Kind::Dynamic => RigidBodyBuilder::dynamic(),
            Kind::Kinematic => RigidBodyBuilder::kinematic_velocity_based(),
        };
        let builder = builder
            .pose(pose(body.translation, body.rotation))
            .linvel(body.linvel.into())
            .angvel(body.angvel.into())
            .can_sleep(body.can_sleep);
        let mut collider = ColliderBuilder::new(shape(body.shape.as_ref()))
            .friction(body.friction)
            .restitution(body.restitution);
        if !body.collides {
            collider = collider.collision_groups(InteractionGroups::none());
        }
        if let Some(mass) = &body.mass {
            collider = collider.mass(*mass.as_ref());
        }
        if let Some(density) = &body.density {
            collider = collider.density(*density.as_ref());
        }
        let (body, collider) = stage.physics.insert(builder, collider);
        stage.rigid.push((name, body, collider));
    }
    scene.joint.iter().try_for_each(|joint| stage.join(joint))?;
    for body in &scene.deformable {
        let name = body.name.as_ref().clone();
        let handle = stage.world.insert(deformable(body, folder));
        stage.deformable.push((name.clone(), handle.map_err(|e| format!("deformable \"{name}\": {e}"))?));
    }
    scene.attach.iter().try_for_each(|attach| stage.attach(attach))?;
    for probe in &scene.probe {
        let owner = stage.deformable.iter().find(|(name, _)| name == probe.of.as_ref());
        let Some(&(_, handle)) = owner else { continue };
        let near = Vector::from(probe.near);
        let body = &stage.world.bodies[handle];
        let distances = body.positions().map(|p| (p - near).length()).enumerate();
        let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(v, _)| v);
        stage.probes.push((probe.name.as_ref().clone(), handle, nearest));
    }
    Ok(stage)
}

fn pose(translation: [f32; 3], degrees: [f32; 3]) -> Pose {
    let rotation = Rotation::from_scaled_axis(Vector::from(degrees.map(f32::to_radians)));
    Pose::from_parts(translation.into(), rotation)
}

/// Lengths and normals were checked with the file.
fn shape(shape: &Shape) -> SharedShape {
    match *shape {
        Shape::Ball { radius } => SharedShape::ball(radius),
        Shape::Cuboid { half_extents: [x, y, z] } => SharedShape::cuboid(x, y, z),
        Shape::Capsule { half_height, radius } => SharedShape::capsule_y(half_height, radius),
        Shape::Cylinder { half_height, radius } => SharedShape::cylinder(half_height, radius),
        Shape::Cone { half_height, radius } => SharedShape::cone(half_height, radius),
        Shape::HalfSpace { normal } => SharedShape::halfspace(Vector::from(normal).normalize()),
    }
}

/// A polyline cut into segments of equal length.
fn polyline(points: &[[f32; 3]], segments: usize) -> Vec<Vector> {
    let points: Vec<Vector> = points.iter().map(|&p| p.into()).collect();
    let lengths: Vec<f32> = points.windows(2).map(|p| (p[1] - p[0]).length()).collect();
    let total: f32 = lengths.iter().sum();
    let at = |mut along: f32| {
        for (ends, length) in points.windows(2).zip(&lengths) {
            if along <= *length {
                return ends[0] + (ends[1] - ends[0]) * (along / length);
            }
            along -= length;
        }
        points.last().copied().unwrap_or_default()
    };
    (0..=segments).map(|k| at(total * k as f32 / segments.max(1) as f32)).collect()
}

/// The shape of a deformable.
fn mesh(body: &Body, folder: &Path) -> DeformableBodyBuilder {
    match body {
        Body::Lattice { half_extents, cells } => {
            DeformableBodyBuilder::cuboid((*half_extents).into(), *cells)
        }
        Body::Filled { shape: filled, cell_size } => {
            DeformableBodyBuilder::filled(&*shape(filled), *cell_size)
        }
        Body::Mesh { path } => DeformableBodyBuilder::gmsh(folder.join(path)),
        Body::Cloth { half_extents, cells, thickness } => {
            DeformableBodyBuilder::cloth(*half_extents, *cells, *thickness)
        }
        Body::Rope { points, segments, radius } => {
            DeformableBodyBuilder::rope(&polyline(points, *segments), *radius)
        }
        Body::Network { half_extents, cells } => {
            match TetMesh::cuboid(half_extents.map(f64::from), *cells) {
                Ok(mesh) => DeformableBodyBuilder::spring_network(&mesh),
                // Which says what is wrong with it.
                Err(_) => DeformableBodyBuilder::cuboid((*half_extents).into(), *cells),
            }
        }
    }
}

/// The preset of a body, changed by the other keys of its solver.
fn solved_by(builder: DeformableBodyBuilder, asked: &file::Solver) -> DeformableBodyBuilder {
    let builder = match asked.fidelity {
        Some(file::Fidelity::Preview) => builder.fidelity(Fidelity::Preview),
        Some(file::Fidelity::Game) => builder.fidelity(Fidelity::Game),
        Some(file::Fidelity::Engineering) => builder.fidelity(Fidelity::Engineering),
        Some(file::Fidelity::Reference) => builder.fidelity(Fidelity::Reference),
        None => builder,
    };
    builder.tune(|settings| {
        if let Some(kind) = asked.kind {
            settings.solver = match kind {
                file::SolverKind::Projective => Solver::Projective,
                file::SolverKind::ConjugateGradients => Solver::ConjugateGradients,
                file::SolverKind::GaussSeidel => Solver::GaussSeidel,
                file::SolverKind::Jacobi => Solver::Jacobi,
                file::SolverKind::Newton => Solver::Newton,
            };
        }
        if let Some(system) = asked.system {
            settings.system = match system {
                file::System::Laplacian => SystemMatrix::Laplacian,
                file::System::RestStiffness => SystemMatrix::RestStiffness,
            };
        }
        if let Some(frames) = asked.frames {
            settings.frames = match frames {
                file::Frames::Floating => Frames::Floating,
                file::Frames::PerNode => Frames::PerNode,
                file::Frames::Automatic => Frames::Automatic,
            };
        }
        settings.max_iterations = asked.max_iterations.unwrap_or(settings.max_iterations);
        settings.tolerance = asked.tolerance.unwrap_or(settings.tolerance);
        settings.contact_tolerance = asked.contact_tolerance.unwrap_or(settings.contact_tolerance);
        settings.acceleration = match asked.lbfgs {
            Some(0) => Acceleration::None,
            Some(window) => Acceleration::Lbfgs { window },
            None => settings.acceleration,
        };
    })
}

fn deformable(body: &file::Deformable, folder: &Path) -> DeformableBodyBuilder {
    let builder = solved_by(mesh(body.body.as_ref(), folder), &body.solver);
    let builder = builder
        .pose(pose(body.translation, body.rotation))
        .linvel(body.linvel.into())
        .angvel(body.angvel.into())
        .material(body.material.as_ref().to_material())
        // What a scene expects of rest is to be found awake.
        .can_sleep(false);
    let builder = builder.self_contact(body.self_contact);
    match body.pinned.clone() {
        Some(regions) => builder.pinned(move |x| {
            let within = |r: &file::Region| x.cmpge(r.min.into()).all() && x.cmple(r.max.into()).all();
            regions.all().iter().any(within)
        }),
        None => builder,
    }
}

impl Stage {
    /// Makes a joint; names were checked with the file.
    fn join(&mut self, joint: &file::Joint) -> Result<(), String> {
        let named = |name: &str| self.rigid.iter().find(|(n, ..)| n == name).map(|(_, body, _)| *body);
        let [Some(first), Some(second)] = joint.between.each_ref().map(|name| named(name.as_ref())) else {
            return Ok(());
        };
        let anchor = |body: RigidBodyHandle| {
            self.physics.bodies[body].position().inverse_transform_point(joint.anchor.into())
        };
        let mut data: GenericJoint = match joint.kind {
            JointKind::Fixed {} => FixedJointBuilder::new().into(),
            JointKind::Revolute { axis } => RevoluteJointBuilder::new(Vector::from(axis).normalize()).into(),
            JointKind::Prismatic { axis } => {
                PrismaticJointBuilder::new(Vector::from(axis).normalize()).into()
            }
        };
        data.set_local_anchor1(anchor(first));
        data.set_local_anchor2(anchor(second));
        let motor = joint.motor.as_ref();
        if let (Some(motor), Some(axis)) = (motor, joint.kind.free_axis()) {
            data.set_motor_model(axis, MotorModel::ForceBased);
            data.set_motor_velocity(axis, motor.velocity, motor.damping);
            data.set_motor_max_force(axis, motor.max_force);
        }
        let made = if joint.multibody {
            let link = self.physics.multibody_joints.insert(first, second, data, true);
            Motored::Link(link.ok_or_else(|| {
                format!("joint: \"{}\" is a link of a multibody already", joint.between[1].as_ref())
            })?)
        } else {
            Motored::Joint(self.physics.impulse_joints.insert(first, second, data, true))
        };
        if motor.is_some() {
            self.motors.push(made);
        }
        Ok(())
    }

    /// Attaches a deformable to a rigid body; names were checked with the file.
    fn attach(&mut self, attach: &file::Attach) -> Result<(), String> {
        let soft = self.deformable.iter().find(|(name, _)| name == attach.deformable.as_ref());
        let rigid = self.rigid.iter().find(|(name, ..)| name == attach.to.as_ref());
        let (Some((name, soft)), Some((_, rigid, _))) = (soft, rigid) else { return Ok(()) };
        let body = &self.world.bodies[*soft];
        let of_surface: std::collections::BTreeSet<usize> =
            body.model().surface_triangles().flatten().map(|v| v as usize).collect();
        let (min, max) = (Vector::from(attach.region.min), Vector::from(attach.region.max));
        let mut vertices = body.vertices_where(|x| x.cmpge(min).all() && x.cmple(max).all());
        vertices.retain(|v| of_surface.contains(v));
        let to = AttachTo::RigidBody(*rigid, *self.physics.bodies[*rigid].position());
        let made = self.world.bodies.attach(*soft, &vertices, to);
        made.map(|_| ()).map_err(|e| format!("attach: \"{name}\": {e}"))
    }

    /// The present value of a quantity of a named thing; names were checked with the file.
    pub fn measure(&self, quantity: Quantity, of: &str, on: Option<&str>) -> f64 {
        if let Some((_, handle)) = self.deformable.iter().find(|(name, _)| name == of) {
            return self.measure_deformable(quantity, *handle, on);
        }
        let (position, speed) =
            if let Some((_, body, vertex)) = self.probes.iter().find(|(name, ..)| name == of) {
                let body = &self.world.bodies[*body];
                let speed = body.velocity(*vertex).map_or(f64::NAN, |[x, y, z]| x.hypot(y).hypot(z));
                (body.position(*vertex).unwrap_or([f64::NAN; 3]), speed)
            } else if let Some((_, handle, _)) = self.rigid.iter().find(|(name, ..)| name == of) {
                let body = &self.physics.bodies[*handle];
                (body.translation().to_array().map(f64::from), f64::from(body.linvel().length()))
            } else {
                return f64::NAN;
            };
        match quantity {
            Quantity::X => position[0],
            Quantity::Y => position[1],
            Quantity::Z => position[2],
            Quantity::Speed => speed,
            Quantity::Force => self.deformable.iter().map(|(_, d)| self.force(*d, of)).sum(),
            Quantity::VolumeRatio | Quantity::Penetration => f64::NAN,
        }
    }

    fn measure_deformable(&self, quantity: Quantity, handle: DeformableBodyHandle, on: Option<&str>) -> f64 {
        let body = &self.world.bodies[handle];
        match quantity {
            Quantity::X => body.center_of_mass()[0],
            Quantity::Y => body.center_of_mass()[1],
            Quantity::Z => body.center_of_mass()[2],
            Quantity::Speed => body.max_speed(),
            Quantity::VolumeRatio => body.volume() / body.model().volume(),
            Quantity::Force => on.map_or(0.0, |on| self.force(handle, on)),
            Quantity::Penetration => {
                let pairs = self.world.pair_contacts().iter();
                let own = pairs.filter(|c| c.body1 == handle || c.body2 == handle).map(|c| -c.gap);
                self.world.contacts_of(handle).map(|c| -c.gap).chain(own).fold(0.0, f64::max)
            }
        }
    }

    /// Vertical force of a named body on a deformable one [N].
    pub fn force(&self, body: DeformableBodyHandle, on: &str) -> f64 {
        if let Some((_, other)) = self.deformable.iter().find(|(name, _)| name == on) {
            return f64::from(self.world.pair_force(body, *other).y);
        }
        let rigid = self.rigid.iter().find(|(name, ..)| name == on);
        rigid.map_or(0.0, |(_, _, collider)| f64::from(self.world.contact_force(body, *collider).y))
    }
}
