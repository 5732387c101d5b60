//! Steps of scenes that have settled into a rhythm take no memory from the allocator.

use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

fn count() {
    COUNT.with(|c| c.set(c.get() + 1));
}

// SAFETY: hands everything to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations of this thread in [`DeformablePipeline::before_step`] over the last `counted` steps.
fn allocations(
    builders: Vec<DeformableBodyBuilder>,
    boxes: &[Vector],
    steps: usize,
    counted: usize,
) -> usize {
    allocations_with(builders, boxes, false, [steps, counted])
}

/// The same; where it is `glued` the first body's top is attached to the first box.
fn allocations_with(
    builders: Vec<DeformableBodyBuilder>,
    boxes: &[Vector],
    glued: bool,
    [steps, counted]: [usize; 2],
) -> usize {
    let mut physics = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    physics.insert(floor, ColliderBuilder::cuboid(20.0, 0.5, 20.0).friction(0.5));
    let mut rigid = Vec::new();
    for at in boxes {
        let body = RigidBodyBuilder::dynamic().translation(*at).can_sleep(false);
        rigid.push(physics.insert(body, ColliderBuilder::cuboid(0.1, 0.1, 0.1).friction(0.5)).0);
    }
    let mut pipeline = DeformablePipeline::new();
    let mut set = DeformableBodySet::new();
    for builder in builders {
        set.insert(builder).unwrap();
    }
    if glued {
        let (handle, body) = set.iter().next().unwrap();
        let top: Vec<usize> =
            (0..body.vertex_count()).filter(|&v| body.model().rest_position(v)[1] > 0.19).collect();
        let to = AttachTo::RigidBody(rigid[0], *physics.bodies[rigid[0]].position());
        set.attach(handle, &top, to).unwrap();
    }
    let parameters = DeformableParameters::default();
    let mut allocated = 0;
    for step in 0..steps {
        let before = COUNT.with(Cell::get);
        pipeline.before_step(&parameters, &mut set, &mut PhysicsParts::from(&mut physics));
        let ours = COUNT.with(Cell::get) - before;
        physics.step();
        // Not counted: writing to a rigid body makes rapier note it in a list, which its step gave away.
        pipeline.after_step(&mut PhysicsParts::from(&mut physics));
        if step + counted >= steps {
            allocated += ours;
        }
    }
    allocated
}

fn cube(e: f64, at: Vector) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::splat(0.2), [4; 3])
        .can_sleep(false)
        .material(DeformableMaterial::new(e, 0.3))
        .translation(at)
}

fn beam() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.05, 0.05), [16, 2, 2])
        .can_sleep(false)
        .material(DeformableMaterial::new(1e6, 0.3))
        .translation(Vector::Y * 3.0)
}

/// On a thread of rayon's own: handing work to others takes memory for its queues.
fn on_one_thread(count: impl FnOnce() -> usize + Send) -> usize {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(count)
}

#[test]
fn the_counter_counts() {
    assert!(allocations(vec![cube(1e6, Vector::Y * 0.21)], &[], 5, 5) > 0);
}

#[test]
fn a_resting_cube_allocates_nothing() {
    assert_eq!(allocations(vec![cube(1e6, Vector::Y * 0.2)], &[], 120, 40), 0);
}

#[test]
fn a_box_on_a_cube_allocates_nothing() {
    assert_eq!(allocations(vec![cube(1e6, Vector::Y * 0.2)], &[Vector::Y * 0.5], 180, 40), 0);
}

#[test]
fn a_box_glued_on_a_cube_allocates_nothing() {
    assert_eq!(allocations_with(vec![cube(1e6, Vector::Y * 0.2)], &[Vector::Y * 0.5], true, [180, 40]), 0);
}

#[test]
fn a_cube_on_a_cube_allocates_nothing() {
    let cubes = vec![cube(1e6, Vector::Y * 0.2), cube(1e6, Vector::new(0.02, 0.6, 0.01))];
    assert_eq!(on_one_thread(|| allocations(cubes, &[], 180, 40)), 0);
}

#[test]
fn a_swinging_beam_allocates_nothing() {
    assert_eq!(allocations(vec![beam().pinned(|x| x.x < -0.49)], &[], 120, 60), 0);
}

#[test]
fn a_tumbling_beam_allocates_nothing() {
    let beam =
        beam().translation(Vector::Y * 500.0).linvel(Vector::Y * 5.0).angvel(Vector::new(20.0, 30.0, 1.0));
    assert_eq!(allocations(vec![beam], &[], 120, 60), 0);
}

#[test]
fn a_sealed_hollow_cube_on_the_floor_allocates_nothing() {
    let hollow =
        TetMesh::cuboid([0.2; 3], [4; 3]).unwrap().without(|x| x.iter().all(|c| c.abs() < 0.1)).unwrap();
    let gas = foible3d::CavityFilling::Gas { gauge: 1e3, ambient: 101_325.0, volume: 0.008, exponent: 1.4 };
    let body = DeformableBodyBuilder::mesh(&hollow).fill_cavity(0, gas).can_sleep(false);
    let body =
        body.material(DeformableMaterial::new(1e6, 0.3).mass_damping(2.0)).translation(Vector::Y * 0.2);
    assert_eq!(allocations(vec![body], &[], 180, 40), 0);
}

fn newton(builder: DeformableBodyBuilder) -> DeformableBodyBuilder {
    builder.settings(SolverSettings::default().solver(Solver::Newton).max_iterations(3))
}

#[test]
fn a_swinging_beam_by_newtons_method_allocates_nothing() {
    assert_eq!(allocations(vec![newton(beam().pinned(|x| x.x < -0.49))], &[], 120, 60), 0);
}

#[test]
fn a_resting_cube_by_newtons_method_allocates_nothing() {
    assert_eq!(allocations(vec![newton(cube(1e6, Vector::Y * 0.2))], &[], 120, 40), 0);
}

#[test]
fn a_box_on_a_cube_by_newtons_method_allocates_nothing() {
    let cube = newton(cube(1e6, Vector::Y * 0.2));
    assert_eq!(on_one_thread(|| allocations(vec![cube], &[Vector::Y * 0.5], 180, 40)), 0);
}

/// Each of two bodies of one island gets its own memory again.
#[test]
fn a_cube_on_another_by_newtons_method_allocates_nothing() {
    let upper = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [3; 3])
        .can_sleep(false)
        .translation(Vector::new(0.02, 0.6, 0.01));
    let cubes = vec![newton(cube(1e6, Vector::Y * 0.2)), newton(upper)];
    assert_eq!(on_one_thread(|| allocations(cubes, &[], 180, 40)), 0);
}

/// Of more than 256 vertices: Newton's method, while it hangs.
#[test]
fn a_hanging_flag_allocates_nothing() {
    let flag = DeformableBodyBuilder::cloth([0.3, 0.2], [20, 16], 5e-4)
        .material(DeformableMaterial::new(1e7, 0.3).density(300.0).mass_damping(4.0))
        .can_sleep(false)
        .translation(Vector::Y * 2.0);
    assert_eq!(allocations(vec![flag.pinned(|x| x.x < -0.299)], &[], 240, 60), 0);
}
