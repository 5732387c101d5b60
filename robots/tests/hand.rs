//! The MJCF hand of three fingers with soft tips lifts a box.

mod common;

use common::{GRAVITY, RATE, STIFF, Scene};
use foible_robots::{JointSolver, RobotBuilder};
use rapier3d::prelude::*;

const FINGERS: [&str; 3] = ["first", "second", "thumb"];
const KNUCKLES: [&str; 3] = ["first_knuckle", "second_knuckle", "thumb_knuckle"];
const TIPS: [&str; 3] = ["first_tip", "second_tip", "thumb_tip"];
/// Of the knuckles' motors [N m/rad], [N m s/rad].
const KNUCKLE: [f32; 2] = [20.0, 0.5];
const MASS: f32 = 0.15;

fn lift(solver: JointSolver) {
    let mut scene = Scene::new(RobotBuilder::mjcf("models/hand.xml"), solver);
    assert_eq!(scene.robot.gravity(), Some(Vector::NEG_Z * GRAVITY));
    scene.drive("palm_lift", 0.0, STIFF);
    KNUCKLES.iter().for_each(|knuckle| scene.drive(knuckle, 0.0, KNUCKLE));
    let object = scene.put(ColliderBuilder::cuboid(0.05, 0.028, 0.025), MASS, Vector::new(0.0, 0.0, 0.025));
    scene.go(&[("palm_lift", -0.07)], 1.0, |_| ());
    // Four millimetres at eight centimetres to the touch, and 0.8 N m beyond.
    let close: Vec<(&'static str, f32)> = KNUCKLES.iter().map(|k| (*k, -0.09)).collect();
    scene.go(&close, 0.5, |_| ());
    scene.wait(0.5);
    let faces = TIPS.map(|tip| scene.pressed(tip, object));
    assert!(faces.iter().all(|face| face.len() > 3), "{faces:?}");
    let mut marks: Vec<[Vector; 3]> = Vec::new();
    let mut look = |scene: &Scene| {
        marks.push(std::array::from_fn(|i| scene.mark(TIPS[i], &faces[i], object)));
    };
    scene.go(&[("palm_lift", 0.05)], 1.5, &mut look);
    scene.go(&[], 2.0, &mut look);
    assert!(scene.is_finite());
    let height = scene.place(object).z;
    let second = RATE as usize;
    let along = |way: Vector| Vector::new(way.x, 0.0, way.z).length();
    let slips = (second..marks.len())
        .flat_map(|i| (0..3).map(move |f| (i, f)))
        .map(|(i, f)| along(marks[i][f] - marks[i - second][f]));
    let slip = slips.fold(0.0, f32::max);
    let carried: Vector = TIPS.iter().map(|tip| scene.force_on(tip)).sum();
    let weight = (MASS + 3.0 * 0.006) * GRAVITY;
    println!("{solver:?}: height {height} m, slip {slip} m/s, fingers carry {} N of {weight} N", carried.z);
    assert!(height > 0.025 + 0.11, "{solver:?}: {height} m");
    assert!(slip < 1.0e-4, "{solver:?}: {slip} m/s");
    assert!((carried.z / weight - 1.0).abs() < 0.01, "{solver:?}: {} N", carried.z);
}

#[test]
fn a_box_is_lifted_by_three_soft_tips() {
    lift(JointSolver::Multibody);
}

#[test]
fn and_with_impulse_joints_too() {
    lift(JointSolver::Impulse);
}

#[test]
fn tips_do_not_touch_their_fingers_but_do_touch_others() {
    let scene = Scene::new(RobotBuilder::mjcf("models/hand.xml"), JointSolver::Multibody);
    for (tip, finger) in TIPS.iter().zip(FINGERS) {
        let part = scene.robot.part(tip).unwrap();
        for other in scene.robot.links() {
            assert_eq!(scene.robot.hooks().are_apart(part.body, other.body), other.name == finger);
        }
    }
}

/// A fixed palm with five fingers of three links, each with a soft pad around its lower half that dips into the link.
fn five_fingers() -> String {
    let mut text = String::from(
        "<mujoco><worldbody><body name='palm' pos='0 0 1'><geom type='box' size='0.1 0.02 0.02'/>\n",
    );
    for finger in 0..5 {
        let x = 0.04 * finger as f32 - 0.08;
        for link in 0..3 {
            let at = if link == 0 { format!("{x} 0 -0.03") } else { "0 0 -0.05".to_string() };
            text += &format!(
                "<body name='f{finger}{link}' pos='{at}'><joint name='j{finger}{link}' axis='1 0 0' range='-90 90'/>\n\
                <geom type='capsule' size='0.008' fromto='0 0 -0.01 0 0 -0.035' mass='0.03'/>\n\
                <flexcomp name='p{finger}{link}' type='grid' dim='3' count='3 3 3' spacing='0.008 0.008 0.008' \
                pos='0 -0.008 -0.025' mass='0.004'><elasticity young='1e5' poisson='0.4'/>\
                <pin gridrange='0 2 0 2 2 2'/></flexcomp>\n"
            );
        }
        text += "</body></body></body>\n";
    }
    text + "</body></worldbody></mujoco>"
}

#[test]
fn fifteen_pads_of_five_fingers_each_keep_apart_from_their_own_link_only() {
    let mut scene = Scene::new(RobotBuilder::mjcf_text(five_fingers(), "models"), JointSolver::Multibody);
    let robot = &scene.robot;
    assert_eq!((robot.links().len(), robot.joints().len(), robot.parts().len()), (16, 15, 15));
    let apart = robot.parts().iter().flat_map(|part| {
        robot.links().iter().map(move |link| (part, link, robot.hooks().are_apart(part.body, link.body)))
    });
    for (part, link, is_apart) in apart {
        assert_eq!(is_apart, part.name[1..] == link.name[1..] && link.name.starts_with('f'), "{}", part.name);
    }
    for _ in 0..30 {
        scene.step();
        // The pads dip into what carries them, by four millimetres: that is no contact.
        for part in scene.robot.parts() {
            let own = scene.robot.link(&part.name.replace('p', "f")).unwrap().colliders[0];
            assert_eq!(scene.deformables.contact_force(part.body, own), Vector::ZERO);
        }
    }
    assert!(scene.is_finite());
}
