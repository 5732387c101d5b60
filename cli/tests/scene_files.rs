//! Wrong scene files and what each is answered: the line, the key, what would be right.

use foible_cli::scene as file;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

const GOOD: &str = r#"[world]
duration = 1.0

[[rigid]]
name = "floor"
kind = "fixed"
shape = { cuboid = { half_extents = [1.0, 0.5, 1.0] } }

[[deformable]]
name = "cube"
body = { lattice = { half_extents = [0.2, 0.2, 0.2], cells = [2, 2, 2] } }
material = { youngs_modulus = 1.0e6, poisson_ratio = 0.3 }

[[probe]]
name = "top"
of = "cube"
near = [0.0, 0.2, 0.0]

[[expect]]
quantity = "force"
of = "cube"
on = "floor"
equals = 10.0
within = 0.1
"#;

#[test]
fn the_good_file_is_taken() {
    file::parse(GOOD).unwrap();
}

#[test]
fn shipped_scenes_parse() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/scenes");
    let scenes = std::fs::read_dir(folder).unwrap().filter_map(|e| Some(e.ok()?.path()));
    let scenes: Vec<_> = scenes.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    assert!(scenes.len() >= 20);
    for path in scenes {
        let parsed = file::parse(&std::fs::read_to_string(&path).unwrap());
        assert!(parsed.is_ok(), "{}: {}", path.display(), parsed.unwrap_err());
    }
}

/// What of the good file is replaced by what; the line; what the answer has to say.
const WRONG: [(&str, &str, usize, &[&str]); 28] = [
    ("duration = 1.0", "duration = -1.0", 2, &["duration", "positive"]),
    ("duration = 1.0", "duration = 0.001", 2, &["duration", "step"]),
    (
        "[[probe]]",
        "[[joint]]\nbetween = [\"floor\", \"bar\"]\nkind = { fixed = {} }\nanchor = [0.0, 0.0, 0.0]\n[[probe]]",
        15,
        &["between", "bar", "floor"],
    ),
    (
        "[[probe]]",
        "[[attach]]\ndeformable = \"cube\"\nto = \"hand\"\nregion = { min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0] }\n[[probe]]",
        16,
        &["to", "hand", "floor"],
    ),
    (
        "[[probe]]",
        "[[move]]\nof = \"floor\"\nduring = [0.0, 1.0]\nby = [0.0, 1.0, 0.0]\n[[probe]]",
        15,
        &["of", "floor", "kinematic", "none"],
    ),
    (
        "[[deformable]]",
        "[[rigid]]\nname = \"plate\"\nkind = \"kinematic\"\nshape = { ball = { radius = 1.0 } }\n[[move]]\nof = \"plate\"\nduring = [1.0, 1.0]\nby = [0.0, 1.0, 0.0]\n[[deformable]]",
        15,
        &["during", "1"],
    ),
    (
        "[[probe]]",
        "[[attach]]\ndeformable = \"floor\"\nto = \"floor\"\nregion = { min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0] }\n[[probe]]",
        15,
        &["deformable", "floor", "cube"],
    ),
    ("[[probe]]", "pinned = 3\n[[probe]]", 14, &["pinned", "min", "list"]),
    ("duration = 1.0", "durations = 1.0", 2, &["durations", "duration"]),
    ("duration = 1.0", "duration = \"long\"", 2, &["duration", "string", "number"]),
    ("duration = 1.0", "duration = 1.0\ndt = 0.0", 3, &["dt", "positive"]),
    ("kind = \"fixed\"", "kind = \"static\"", 6, &["static", "fixed", "dynamic", "kinematic"]),
    ("cuboid = { half", "cubold = { half", 7, &["cubold", "cuboid"]),
    ("half_extents = [1.0, 0.5, 1.0]", "half_extents = [1.0, 0.5]", 7, &["half_extents", "2", "3"]),
    ("poisson_ratio = 0.3", "poisson = 0.3", 12, &["poisson", "poisson_ratio"]),
    ("youngs_modulus = 1.0e6, ", "", 12, &["missing", "youngs_modulus"]),
    ("poisson_ratio = 0.3", "poisson_ratio = 0.6", 12, &["material", "Poisson's ratio", "0.6", "0.4999"]),
    ("poisson_ratio = 0.3", "poisson_ratio = 0.3, friction = -1.0", 12, &["friction", "-1", "positive"]),
    ("cells = [2, 2, 2]", "cells = [2, 0, 2]", 11, &["body", "cells", "0"]),
    (
        "lattice = { half_extents = [0.2, 0.2, 0.2], cells = [2, 2, 2] }",
        "filled = { shape = { ball = { radius = -1.0 } }, cell_size = 0.1 }",
        11,
        &["body", "radius", "positive", "-1"],
    ),
    (
        "cuboid = { half_extents = [1.0, 0.5, 1.0] }",
        "half_space = { normal = [0.0, 0.0, 0.0] }",
        7,
        &["shape", "normal", "zero"],
    ),
    ("name = \"cube\"", "name = \"floor\"", 10, &["floor", "unique"]),
    ("of = \"cube\"\nnear", "of = \"sphere\"\nnear", 16, &["sphere", "of", "cube"]),
    ("on = \"floor\"", "on = \"ceiling\"", 22, &["ceiling", "on", "floor"]),
    ("on = \"floor\"\n", "", 20, &["force", "on"]),
    ("quantity = \"force\"", "quantity = \"weight\"", 20, &["weight", "force", "volume_ratio"]),
    ("within = 0.1\n", "", 20, &["equals", "within"]),
    ("equals = 10.0", "equals = 10.0\nat = 7.0", 24, &["at", "7", "1"]),
];

#[test]
fn wrong_files_are_answered_with_line_key_and_what_would_be_right() {
    for (right, wrong, line, says) in WRONG {
        assert!(GOOD.contains(right), "{right}");
        let answer = file::parse(&GOOD.replacen(right, wrong, 1)).unwrap_err().to_string();
        println!("{wrong:?} → {answer}\n");
        assert!(answer.starts_with(&format!("line {line},")), "{wrong:?}: {answer}");
        // Without the quoted line, which holds the key anyhow.
        let said = answer.lines().next().unwrap();
        for word in says {
            assert!(said.contains(word), "{wrong:?} should say {word:?}: {answer}");
        }
    }
}

/// What a scene says of parameters, units, formulas, includes and sweeps.
#[test]
fn formulas_units_and_includes_are_read() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("includes");
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write(
        "_floor.toml",
        "[parameters]\nthick = \"10 cm\"\nwide = 1.0\n[[rigid]]\nname = \"floor\"\nkind = \"fixed\"\n\
        shape = { cuboid = { half_extents = [\"=wide\", \"=thick/2\", \"=wide\"] } }\n",
    );
    write(
        "a.toml",
        "include = [\"_floor.toml\"]\n[parameters]\nwide = \"=2*1.5\"\n[world]\nduration = \"500 ms\"\n",
    );
    let read = |set: &[(&str, &str)]| {
        let set: Vec<_> = set.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        file::SceneFile::read(&folder.join("a.toml"), &set)
    };
    let half_extents = |file: &file::SceneFile| match file.scene.rigid[0].shape.as_ref() {
        file::Shape::Cuboid { half_extents } => *half_extents,
        other => panic!("{other:?}"),
    };
    let plain = read(&[]).unwrap();
    assert_eq!((half_extents(&plain), plain.paths.len()), ([3.0, 0.05, 3.0], 2));
    assert_eq!(*plain.scene.world.duration.as_ref(), 0.5);
    let set = read(&[
        ("thick", "=0.3"),
        ("world.duration", "2 s"),
        ("rigid.floor.kind", "dynamic"),
        ("rigid.0.mass", "3"),
        ("rigid.floor.linvel", "[0, \"36 km/h\", \"=wide\"]"),
    ])
    .unwrap();
    assert_eq!((half_extents(&set), set.scene.rigid[0].kind), ([3.0, 0.15, 3.0], file::Kind::Dynamic));
    assert_eq!(
        (*set.scene.world.duration.as_ref(), *set.scene.rigid[0].mass.as_ref().unwrap().as_ref()),
        (2.0, 3.0)
    );
    assert_eq!(set.scene.rigid[0].linvel, [0.0, 10.0, 3.0]);
    // A mistake in an included file is told with that file.
    write(
        "_floor.toml",
        "[[rigid]]\nname = \"floor\"\nkind = \"fixed\"\nshape = { ball = { radius = \"=wde\" } }\n",
    );
    let wrong = read(&[]).unwrap_err();
    assert_eq!((wrong.line, wrong.column), (4, 29), "{wrong}");
    assert!(wrong.to_string().contains("_floor.toml, line 4") && wrong.what.contains("wde"), "{wrong}");
    // What cannot stand behind another file.
    for (text, says) in
        [("gravity = [0, 0, 0]\n", "tables only"), ("parameters = { k = 2 }\n", "tables only")]
    {
        write("_floor.toml", text);
        let wrong = read(&[]).unwrap_err();
        assert!(wrong.what.contains(says) && wrong.to_string().contains("_floor.toml, line 1"), "{wrong}");
    }
    write("_floor.toml", "[ parameters ]\nwide = 7\nhigh = \"see [parameters]\"\n");
    assert_eq!(read(&[]).unwrap().scene.rigid.len(), 0);
    write("_floor.toml", "include = [\"a.toml\"]\n");
    assert!(read(&[]).unwrap_err().what.contains("include"), "{}", read(&[]).unwrap_err());
}

/// Huge values are refused by name, before anything is made of them.
#[test]
fn huge_values_are_refused_by_name() {
    for (right, wrong, key) in [
        ("cells = [2, 2, 2]", "cells = [2000000, 2000000, 2000000]", "cells"),
        ("cells = [2, 2, 2]", "cells = [18446744073709551615, 1, 1]", "cells"),
        ("duration = 1.0", "duration = 1e30", "duration"),
        ("duration = 1.0", "duration = 1.0\ndt = 1e-30", "duration"),
        ("duration = 1.0", "duration = 1.0\ngravity = [0.0, -1e30, 0.0]", "gravity"),
        ("half_extents = [1.0, 0.5, 1.0]", "half_extents = [1e30, 0.5, 1.0]", "half_extents"),
        ("name = \"cube\"", "name = \"cube\"\ntranslation = [inf, 0.0, 0.0]", "translation"),
        (
            "lattice = { half_extents = [0.2, 0.2, 0.2], cells = [2, 2, 2] }",
            "filled = { shape = { ball = { radius = 1.0 } }, cell_size = 1e-6 }",
            "cell_size",
        ),
        (
            "lattice = { half_extents = [0.2, 0.2, 0.2], cells = [2, 2, 2] }",
            "rope = { points = [[0, 0, 0], [1, 0, 0]], segments = 900000000000, radius = 0.1 }",
            "segments",
        ),
    ] {
        let answer = file::parse(&GOOD.replacen(right, wrong, 1)).unwrap_err();
        assert!(answer.what.contains(key) && answer.line > 0, "{wrong}: {answer}");
    }
}

/// The schema that is shipped is that of the code, and names every table.
#[test]
fn the_schema_is_that_of_the_code() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scene.schema.json");
    let shipped = std::fs::read_to_string(path).unwrap_or_default();
    let found = serde_json::to_string_pretty(&file::schema()).unwrap() + "\n";
    assert!(shipped == found, "write it anew: foible schema > cli/scene.schema.json");
    for table in [
        "world",
        "rigid",
        "joint",
        "deformable",
        "attach",
        "move",
        "drop",
        "probe",
        "measure",
        "expect",
        "sweep",
    ] {
        assert!(file::schema()["properties"][table].is_object(), "{table}");
    }
}

/// Damages a scene: bytes and words changed, left out, doubled, lines exchanged.
fn damaged(text: &str, changes: &[(usize, usize, u8)]) -> String {
    let mut text: Vec<char> = text.chars().collect();
    for (at, other, kind) in changes {
        let count = text.len().max(1);
        let (at, other) = (at % count, other % count);
        let words = [
            "1e999",
            "-1",
            "nan",
            "\"",
            "[",
            "{",
            "]]",
            "=",
            "\"=1/0\"",
            "\"5 mm\"",
            "99999999999",
            "include = [\"x\"]\n",
            "\n",
        ];
        match kind % 5 {
            0 => text[at.min(count - 1)] = words[other % words.len()].chars().next().unwrap(),
            1 => drop(text.drain(at.min(other)..at.max(other).min(at.min(other) + 12))),
            2 => drop(text.splice(at..at, words[other % words.len()].chars())),
            3 => {
                let piece: Vec<char> = text[at.min(other)..at.max(other).min(at.min(other) + 40)].to_vec();
                text.splice(at..at, piece);
            }
            _ => text.swap(at, other),
        }
        if text.is_empty() {
            text.push(' ');
        }
    }
    text.into_iter().collect()
}

#[test]
fn ten_thousand_damaged_scenes_are_errors_with_a_line_or_scenes() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/scenes");
    let scenes = std::fs::read_dir(folder).unwrap().filter_map(|e| Some(e.ok()?.path()));
    let scenes: Vec<String> = scenes
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .map(|p| std::fs::read_to_string(p).unwrap())
        .collect();
    let config = Config { failure_persistence: None, ..Config::with_cases(10_000) };
    let how =
        (any::<usize>(), proptest::collection::vec((any::<usize>(), any::<usize>(), any::<u8>()), 1..6));
    let counted = std::cell::Cell::new((0, 0));
    let result = TestRunner::new(config).run(&how, |(which, changes)| {
        let text = damaged(&scenes[which % scenes.len()], &changes);
        match file::parse(&text) {
            Ok(_) => counted.set((counted.get().0 + 1, counted.get().1)),
            Err(error) => {
                counted.set((counted.get().0, counted.get().1 + 1));
                prop_assert!(!error.what.is_empty());
                prop_assert!(error.line >= 1 && error.line <= text.lines().count() + 1, "{error}");
            }
        }
        Ok(())
    });
    result.unwrap_or_else(|error| panic!("{error}"));
    let (read, refused) = counted.get();
    println!("{read} are scenes, {refused} are refused");
    assert!(read > 100 && refused > 1000);
}
