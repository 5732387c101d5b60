//! Wrong scene files and what each is answered: the line, the key, what would be right.

use foible_cli::scene as file;

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
    assert!(scenes.len() >= 5);
    for path in scenes {
        let parsed = file::parse(&std::fs::read_to_string(&path).unwrap());
        assert!(parsed.is_ok(), "{}: {}", path.display(), parsed.unwrap_err());
    }
}

/// What of the good file is replaced by what; the line; what the answer has to say.
const WRONG: [(&str, &str, usize, &[&str]); 27] = [
    ("duration = 1.0", "duration = -1.0", 2, &["duration", "positive"]),
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
