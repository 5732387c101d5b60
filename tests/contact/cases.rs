//! Stiffnesses, Poisson's ratios and iteration counts that cubes are tried with.

/// Which of them.
#[derive(Clone, Copy, PartialEq)]
pub enum Cases {
    All,
    /// Those whose places in their lists add up to an even number: of five stiffnesses, any two values of different lists come together.
    Even,
    /// The others.
    Odd,
}

pub const STIFFNESSES: [f64; 5] = [1e5, 1e6, 1e7, 1e8, 1e9];

pub fn cases(stiffnesses: &[f64], which: Cases) -> Vec<(f64, f64, usize)> {
    let mut cases = Vec::new();
    for (a, &e) in stiffnesses.iter().enumerate() {
        for (b, nu) in [0.3, 0.45].into_iter().enumerate() {
            for (c, iterations) in [1, 3, 10].into_iter().enumerate() {
                let own = if (a + b + c) % 2 == 0 { Cases::Even } else { Cases::Odd };
                if which == Cases::All || which == own {
                    cases.push((e, nu, iterations));
                }
            }
        }
    }
    cases
}
