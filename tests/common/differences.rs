//! Runs whose losses are differentiated twice: by a tape, and by differences between whole runs.
#![allow(dead_code)]

#[path = "parameters.rs"]
mod parameters;

use foible3d::prelude::*;
pub use parameters::*;
use rapier3d::prelude::*;

/// What a run depends on.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    pub material: DeformableMaterial,
    pub gravity: f64,
    /// Force along z \[N\] on the tip.
    pub push: f64,
    /// Velocity along y [m/s] of the tip at first, and its shift along z \[m\].
    pub throw: f64,
    pub place: f64,
    /// Velocity of all vertices along x and y.
    pub launch: [f64; 2],
    /// Velocity of the pins along z [m/s].
    pub lead: f64,
    pub activation: f64,
    /// What fills the first cavity.
    pub filling: Option<CavityFilling>,
    /// Of the last end of the first rod, if that is held \[rad\].
    pub roll: Option<f64>,
    /// What draws the cable.
    pub pull: Option<Pull>,
    /// The air around the body.
    pub wind: Option<DeformableWind>,
    /// Of the floor; none if there is no friction.
    pub friction: f64,
}

impl Run {
    pub fn of(material: DeformableMaterial) -> Self {
        Self {
            material,
            gravity: -9.75,
            push: 0.5,
            throw: 0.25,
            place: 0.001953125,
            launch: [0.0; 2],
            lead: 0.25,
            activation: 1.0,
            filling: None,
            roll: None,
            pull: None,
            wind: None,
            friction: 0.0,
        }
    }
}

/// How a cable is drawn.
#[derive(Clone, Copy, Debug)]
pub enum Pull {
    /// With a tension \[N\].
    Tension(f64),
    /// To a length without tension \[m\], with a stretch per tension [m/N].
    Length(f64, f64),
    /// As long as it is, with a stretch per tension.
    AsItIs(f64),
}

/// The points of a cable through a body.
pub type Route = fn(DeformableBodyHandle, &DeformableBody, &mut PhysicsWorld) -> Vec<CablePoint>;

/// What is run.
#[derive(Clone)]
pub struct Scene {
    pub builder: DeformableBodyBuilder,
    /// At least up to that which is looked at.
    pub steps: usize,
    /// Height of a floor.
    pub floor: Option<f32>,
    /// Young's moduli of other regions.
    pub regions: Vec<(u32, f64)>,
    /// Stiffness damping of those, if it is not that of the run.
    pub beta: Option<f64>,
    pub keeps_spin: bool,
    /// Of a cable, if there is one.
    pub route: Option<Route>,
    /// The step whose contact force is looked at: what lies on a floor still settles then.
    pub look: usize,
    /// Of all differences.
    pub stride: f64,
}

/// What came of a run.
pub struct Outcome {
    pub loss: f64,
    pub tape: DeformableTape,
    pub seeds: DeformableLoss,
    pub tip: usize,
    pub h: f64,
    pub contact_force: [f64; 3],
    /// Of the first cavity at the end of each step \[m³\].
    pub volumes: Vec<f64>,
    pub filling: Option<CavityFilling>,
    pub floor: Option<ColliderHandle>,
    pub cable: Option<DeformableCableHandle>,
    /// Of the cable in the step that is looked at \[N\].
    pub tension: f64,
    /// Steps in which it was taut.
    pub taut: usize,
}

/// What a run begins with.
struct Start {
    physics: PhysicsWorld,
    world: DeformableWorld,
    handle: DeformableBodyHandle,
    tip: usize,
    floor: Option<ColliderHandle>,
    cable: Option<DeformableCableHandle>,
}

/// Numbers without a pattern.
pub fn weight(k: usize) -> f64 {
    ((k * 7919 + 13) % 101) as f64 / 50.0 - 1.0
}

fn add_floor(physics: &mut PhysicsWorld, height: f32, friction: f64) -> ColliderHandle {
    let slab = ColliderBuilder::cuboid(50.0, 1.0, 50.0).friction(friction as f32);
    let slab = slab.friction_combine_rule(CoefficientCombineRule::Max);
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * (height - 1.0)), slab).1
}

impl Scene {
    pub fn new(builder: DeformableBodyBuilder) -> Self {
        Self {
            builder,
            steps: 20,
            floor: None,
            regions: Vec::new(),
            beta: None,
            keeps_spin: false,
            route: None,
            look: 7,
            stride: 1.0,
        }
    }

    pub fn is_sheet(&self) -> bool {
        self.builder.clone().build().unwrap().model().surface_triangles().len() > 0
    }

    fn start(&self, run: &Run) -> Start {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::Y * run.gravity as f32;
        let floor = self.floor.map(|height| add_floor(&mut physics, height, run.friction));
        let mut world = DeformableWorld::new();
        let builder = self.builder.clone().material(run.material).can_sleep(false);
        let builder = run.roll.map_or(builder.clone(), |roll| builder.hold_twist(0, roll));
        let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-12).max_iterations(400);
        let handle = world
            .insert(builder.settings(settings.contact_tolerance(1e-12).keeps_spin(self.keeps_spin)))
            .unwrap();
        let cable = self.route.map(|route| {
            let points = route(handle, &world.bodies[handle], &mut physics);
            let cable = DeformableCableBuilder::new(points);
            let cable = match run.pull.unwrap() {
                Pull::Tension(tension) => cable.tension(tension),
                Pull::Length(length, compliance) => cable.length(length).compliance(compliance),
                Pull::AsItIs(compliance) => cable.compliance(compliance),
            };
            world.bodies.insert_cable(cable).unwrap()
        });
        let body = &mut world.bodies[handle];
        for (region, modulus) in &self.regions {
            let beta = self.beta.unwrap_or(run.material.stiffness_damping);
            let material = run.material.youngs_modulus(*modulus).stiffness_damping(beta);
            body.set_region_material(*region, material).unwrap();
        }
        let far = |v: &usize| body.position(*v).unwrap()[0];
        let tip = (0..body.vertex_count()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
        let [x, y, z] = body.position(tip).unwrap();
        body.set_position(tip, [x, y, z + run.place]).unwrap();
        for vertex in 0..body.vertex_count() {
            let y = run.launch[1] + if vertex == tip { run.throw } else { 0.0 };
            body.set_velocity(vertex, Vector::new(run.launch[0] as f32, y as f32, 0.0)).unwrap();
        }
        body.add_force(&[tip], Vector::Z * run.push as f32).unwrap();
        body.set_activation(run.activation).unwrap();
        body.set_wind(run.wind).unwrap();
        run.filling.iter().for_each(|filling| body.fill_cavity(0, Some(*filling)).unwrap());
        for vertex in body.pinned().collect::<Vec<_>>() {
            body.set_velocity(vertex, Vector::ZERO).unwrap();
            body.set_pin_velocity(vertex, Vector::Z * run.lead as f32).unwrap();
        }
        Start { physics, world, handle, tip, floor, cable }
    }

    pub fn run(&self, run: &Run) -> Outcome {
        let Start { mut physics, mut world, handle, tip, floor, cable } = self.start(run);
        let mut tape = DeformableTape::new(&world, handle).unwrap();
        let (mut losses, mut volumes, mut tension, mut taut) = (Vec::new(), Vec::new(), 0.0, 0);
        let steps = self.steps.max(self.look + 1);
        for step in 0..steps {
            tape.step(&mut physics, &mut world).unwrap();
            volumes.extend(world.bodies[handle].cavity_volume(0));
            let drawn = cable.map_or(0.0, |cable| world.bodies.cable(cable).unwrap().tension());
            taut += usize::from(drawn > 0.0);
            if step == self.look {
                tension = drawn;
            }
            if step + 1 == steps || step + 1 == steps / 2 {
                let body = &world.bodies[handle];
                let at = |v: usize| (body.position(v).unwrap(), body.velocity(v).unwrap());
                losses.push((step, (0..body.vertex_count()).map(at).collect::<Vec<_>>()));
            }
        }
        let (mut loss, mut seeds) = (0.0, tape.loss());
        for (step, states) in losses {
            for (vertex, (x, v)) in states.into_iter().enumerate() {
                let a = [0, 1, 2].map(|k| weight(3 * vertex + k));
                let b = [0, 1, 2].map(|k| 0.02 * weight(5 * vertex + k));
                // Squares too: derivatives that depend on where it is.
                loss += (0..3).map(|k| a[k] * x[k] + 0.5 * x[k] * x[k] + b[k] * v[k]).sum::<f64>();
                seeds.add_position(step, vertex, [0, 1, 2].map(|k| a[k] + x[k])).unwrap();
                seeds.add_velocity(step, vertex, b).unwrap();
            }
        }
        let contact_force = floor.map_or([0.0; 3], |floor| tape.contact_force(self.look, floor));
        let h = f64::from(physics.integration_parameters.dt);
        Outcome {
            loss,
            tape,
            seeds,
            tip,
            h,
            contact_force,
            volumes,
            filling: run.filling,
            floor,
            cable,
            tension,
            taut,
        }
    }
}

/// Derivatives of what a change leads to, by differences of the fourth order.
pub fn slopes<const N: usize>(by: f64, mut at: impl FnMut(f64) -> [f64; N]) -> [f64; N] {
    let [near, less, far, farther_less] = [1.0, -1.0, 2.0, -2.0].map(|d| at(d * by));
    std::array::from_fn(|k| (8.0 * (near[k] - less[k]) - (far[k] - farther_less[k])) / (12.0 * by))
}

/// Settings of the states that are differentiated: solved to rounding.
pub fn strict() -> SolverSettings {
    let settings = SolverSettings::default().solver(Solver::Newton).tolerance(1e-12).max_iterations(400);
    settings.contact_tolerance(1e-12).keeps_spin(false)
}

/// The vertex nearest to a place.
pub fn nearest(body: &DeformableBody, place: [f64; 3]) -> usize {
    let far = |v: &usize| {
        let x = body.position(*v).unwrap();
        (0..3).map(|k| (x[k] - place[k]).powi(2)).sum::<f64>()
    };
    (0..body.vertex_count()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap()
}

/// A loss of what came of a run, its derivatives, and which parameters it feels enough to tell.
pub struct Sought<'a> {
    pub loss: &'a dyn Fn(&Outcome) -> f64,
    pub seeds: &'a dyn Fn(&Outcome) -> DeformableLoss,
    pub feels: &'a dyn Fn(&Parameter) -> bool,
}

/// The loss that a run has.
const OF_STATE: Sought<'static> =
    Sought { loss: &|out| out.loss, seeds: &|out| out.seeds.clone(), feels: &|_| true };

/// The largest relative errors of the tape's derivatives of some losses against differences of the fourth order between whole runs.
fn largest_errors<'a, const N: usize>(
    scene: &Scene,
    run: &Run,
    sought: [Sought<'_>; N],
    parameters: impl IntoIterator<Item = &'a Parameter>,
) -> [f64; N] {
    let out = scene.run(run);
    let gradients = sought.each_ref().map(|sought| out.tape.backward(&(sought.seeds)(&out)).unwrap());
    let mut largest = [0.0_f64; N];
    for parameter in parameters {
        let at = |d: f64| {
            let mut changed = *run;
            (parameter.change)(&mut changed, d);
            let changed = scene.run(&changed);
            sought.each_ref().map(|sought| (sought.loss)(&changed))
        };
        let slopes = slopes(parameter.by * scene.stride, at);
        for (k, (sought, slope)) in sought.iter().zip(slopes).enumerate() {
            if !(sought.feels)(parameter) {
                continue;
            }
            let ours = (parameter.of)(&gradients[k], &out);
            let error = (ours / slope - 1.0).abs();
            println!("  loss {k}, {}: {ours:.9e} against {slope:.9e}, {error:.1e}", parameter.name);
            // NaN must not vanish in a maximum.
            largest[k] = if error.is_nan() { f64::INFINITY } else { largest[k].max(error) };
        }
    }
    largest
}

/// As [`largest_errors`], of the loss that a run has.
pub fn state_error<'a>(scene: &Scene, run: &Run, parameters: impl IntoIterator<Item = &'a Parameter>) -> f64 {
    let [error] = largest_errors(scene, run, [OF_STATE], parameters);
    error
}

/// As [`state_error`], and of another loss.
pub fn errors_of_state_and<'a>(
    scene: &Scene,
    run: &Run,
    other: Sought<'_>,
    parameters: impl IntoIterator<Item = &'a Parameter>,
) -> [f64; 2] {
    largest_errors(scene, run, [OF_STATE, other], parameters)
}

/// As [`errors_of_state_and`], of the force of the floor in the step that the scene looks at, in a direction askew.
pub fn errors_of_state_and_force<'a>(
    scene: &Scene,
    run: &Run,
    feels: &dyn Fn(&Parameter) -> bool,
    parameters: impl IntoIterator<Item = &'a Parameter>,
) -> [f64; 2] {
    let across = [0.25, 1.0, -0.5];
    let loss = |out: &Outcome| (0..3).map(|k| across[k] * out.contact_force[k]).sum::<f64>();
    let seeds = |out: &Outcome| {
        let mut seeds = out.tape.loss();
        seeds.add_contact_force(scene.look, out.floor.unwrap(), across).unwrap();
        seeds
    };
    errors_of_state_and(scene, run, Sought { loss: &loss, seeds: &seeds, feels }, parameters)
}
