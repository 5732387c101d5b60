//! Solves with a supernodal Cholesky factor, node by node.
//!
//! `L` is cut into supernodes: columns of equal pattern, dense, the triangle `T` on top of the rows `B` below it. Kept
//! is not `L` but `M = [T⁻¹; −B T⁻¹]`: then a supernode is one product on the way forward,
//! `[x_T; x_B] ← [0; x_B] + M x_T`, and one with the transpose on the way back, `x_T ← Mᵀ [x_T; x_B]`, without a
//! chain of unknowns that wait for one another.
//!
//! One solve reads every number twice and does little else, so they stand in the order in which the way forward reads
//! them: in a supernode the last group of node columns first, in a group row node by row node, there column by
//! column the block's numbers. All unknowns of a node stand together, so nothing is gathered.

use crate::math::lanes::Lane;
use crate::math::vectorized;

/// Where the supernodes of a factor are, in nodes.
#[derive(Debug, Default)]
pub(crate) struct Supernodes {
    /// Unknowns per node: 3, or 1 where the axes have the same matrix.
    d: usize,
    /// First node of each supernode, and the number of nodes last.
    begin: Vec<usize>,
    /// First of the nodes below the triangle of each supernode in `rows`, and their number last.
    row_begin: Vec<usize>,
    rows: Vec<usize>,
    /// First number of each supernode, and how many there are last.
    value_begin: Vec<usize>,
}

/// A number of a factor: single or double precision, computed with in double.
pub(crate) trait Entry: Copy + Into<f64> {}

impl Entry for f32 {}
impl Entry for f64 {}

/// Numbers after the last one, as the last block of three is read with one more.
const PADDING: usize = 1;

impl Supernodes {
    /// None yet, of nodes of `d` unknowns.
    pub fn new(d: usize) -> Self {
        Self { d, begin: vec![0], row_begin: vec![0], rows: Vec::new(), value_begin: vec![0] }
    }

    /// Appends one that ends before node `end`, with the nodes of its rows below.
    pub fn push(&mut self, end: usize, rows: impl Iterator<Item = usize>) {
        let p = end - self.begin[self.count()];
        self.begin.push(end);
        self.rows.extend(rows);
        let m = p + self.rows.len() - self.row_begin[self.count() - 1];
        self.row_begin.push(self.rows.len());
        let nodes: usize = groups(self.d, p).map(|(first, width)| (m - first) * width).sum();
        self.value_begin.push(self.value_begin[self.count() - 1] + self.d * self.d * nodes);
    }

    pub fn count(&self) -> usize {
        self.begin.len() - 1
    }

    /// Numbers of a factor.
    pub fn len(&self) -> usize {
        self.value_begin[self.count()] + PADDING
    }

    /// Nodes of a supernode, and those of the rows below.
    #[inline(always)]
    pub fn nodes(&self, s: usize) -> (std::ops::Range<usize>, &[usize]) {
        (self.begin[s]..self.begin[s + 1], &self.rows[self.row_begin[s]..self.row_begin[s + 1]])
    }

    /// Sets the numbers of a supernode from M by columns.
    pub fn pack(&self, s: usize, M: &[f64], values: &mut [f64]) {
        match self.d {
            1 => self.pack_blocks::<1>(s, M, values),
            _ => self.pack_blocks::<3>(s, M, values),
        }
    }

    fn pack_blocks<const D: usize>(&self, s: usize, M: &[f64], values: &mut [f64]) {
        self.for_each_block(s, |packed, place| {
            values[packed..packed + D].copy_from_slice(&M[place..place + D]);
        });
    }

    /// M of a supernode by columns.
    pub fn unpack<T: Entry>(&self, s: usize, values: &[T], M: &mut Vec<f64>) {
        let (own, rows) = self.nodes(s);
        let d = self.d;
        M.clear();
        M.resize(d * own.len() * d * (own.len() + rows.len()), 0.0);
        self.for_each_block(s, |packed, place| {
            M[place..place + d].iter_mut().zip(&values[packed..packed + d]).for_each(|(m, &v)| *m = v.into());
        });
    }

    /// Calls `with` with where the numbers of a node in a column stand among the values, and in M by columns.
    #[inline(always)]
    fn for_each_block(&self, s: usize, mut with: impl FnMut(usize, usize)) {
        let (own, rows) = self.nodes(s);
        let (d, m) = (self.d, own.len() + rows.len());
        let mut packed = self.value_begin[s];
        for (first, width) in groups(d, own.len()).rev() {
            for k in first..m {
                for column in d * first..d * (first + width) {
                    with(packed, d * (column * m + k));
                    packed += d;
                }
            }
        }
    }

    /// Solves `A x = b` in place, three right-hand sides side by side where `d` is 1; the fourth numbers are zero.
    pub fn solve<T: Entry>(&self, values: &[T], x: &mut [Lane]) {
        match self.d {
            1 => solve(Blocks::<1>(self), values, x),
            _ => solve(Blocks::<3>(self), values, x),
        }
    }
}

/// Node columns that one pass over the rows takes together.
#[inline(always)]
const fn group_width(d: usize) -> usize {
    if d == 1 { 4 } else { 2 }
}

/// First and number of the node columns of each group of a supernode of `p` nodes: what does not fill a group goes
/// one by one.
#[inline(always)]
fn groups(d: usize, p: usize) -> impl DoubleEndedIterator<Item = (usize, usize)> {
    let width = group_width(d);
    let whole = p / width;
    (0..whole).map(move |k| (k * width, width)).chain((whole * width..p).map(|k| (k, 1)))
}

/// Supernodes of nodes of D unknowns.
struct Blocks<'a, const D: usize>(&'a Supernodes);

vectorized! {
fn solve[T: Entry, const D: usize](nodes: Blocks<'_, D>, values: &[T], x: &mut [Lane]) {
    for s in 0..nodes.0.count() {
        let panel = nodes.panel(s, values);
        // Of the forces of contacts most is zero, and stays so until it meets some on the way to the root.
        if x[panel.own.clone()].iter().any(|v| *v != Lane::default()) {
            panel.forward(x);
        }
    }
    for s in (0..nodes.0.count()).rev() {
        nodes.panel(s, values).backward(x);
    }
}
}

impl<const D: usize> Blocks<'_, D> {
    #[inline(always)]
    fn panel<'a, T: Entry>(&'a self, s: usize, values: &'a [T]) -> Panel<'a, T, D> {
        let (own, rows) = self.0.nodes(s);
        let values = &values[self.0.value_begin[s]..self.0.value_begin[s + 1] + PADDING];
        Panel { own, rows, values }
    }
}

/// One supernode.
struct Panel<'a, T, const D: usize> {
    own: std::ops::Range<usize>,
    rows: &'a [usize],
    values: &'a [T],
}

impl<'a, T: Entry, const D: usize> Panel<'a, T, D> {
    /// Columns from the last to the first: what a node becomes no earlier column needs.
    #[inline(always)]
    fn forward(&self, x: &mut [Lane]) {
        let mut at = 0;
        let mut first = self.own.len();
        while !first.is_multiple_of(group_width(D)) {
            first -= 1;
            at += match D {
                1 => self.forward_group::<1>(first, &self.values[at..], x),
                _ => self.forward_group::<3>(first, &self.values[at..], x),
            };
        }
        while first > 0 {
            first -= group_width(D);
            at += match D {
                1 => self.forward_group::<4>(first, &self.values[at..], x),
                _ => self.forward_group::<6>(first, &self.values[at..], x),
            };
        }
    }

    /// The G columns from node `first`; returns how many numbers they have.
    #[inline(always)]
    fn forward_group<const G: usize>(&self, first: usize, values: &[T], x: &mut [Lane]) -> usize {
        let own = &mut x[self.own.start + first..self.own.end];
        let w: [Lane; G] = std::array::from_fn(|g| match D {
            1 => own[g],
            _ => {
                let v = own[g / 3].0[g % 3];
                Lane([v, v, v, 0.0])
            }
        });
        own[..G / D].fill(Lane::default());
        let mut at = 0;
        for sum in own {
            *sum = plus_product::<T, D, G>(&values[at..at + D * G + PADDING], &w, *sum);
            at += D * G;
        }
        for &row in self.rows {
            // Another supernode may just have written there: what does not wait for it first.
            x[row] += plus_product::<T, D, G>(&values[at..at + D * G + PADDING], &w, Lane::default());
            at += D * G;
        }
        at
    }

    /// Columns from the first to the last: none needs an earlier node.
    #[inline(always)]
    fn backward(&self, x: &mut [Lane]) {
        let mut end = self.values.len() - PADDING;
        let mut first = 0;
        while first + group_width(D) <= self.own.len() {
            end -= self.numbers(first, group_width(D));
            match D {
                1 => self.backward_group::<4>(first, &self.values[end..], x),
                _ => self.backward_group::<6>(first, &self.values[end..], x),
            }
            first += group_width(D);
        }
        while first < self.own.len() {
            end -= self.numbers(first, 1);
            match D {
                1 => self.backward_group::<1>(first, &self.values[end..], x),
                _ => self.backward_group::<3>(first, &self.values[end..], x),
            }
            first += 1;
        }
    }

    /// Of a group of node columns.
    #[inline(always)]
    fn numbers(&self, first: usize, width: usize) -> usize {
        D * D * width * (self.own.len() + self.rows.len() - first)
    }

    #[inline(always)]
    fn backward_group<const G: usize>(&self, first: usize, values: &[T], x: &mut [Lane]) {
        let mut sums = [Lane::default(); G];
        let mut at = 0;
        for v in &x[self.own.start + first..self.own.end] {
            add_transposed::<T, D, G>(&values[at..at + D * G + PADDING], *v, &mut sums);
            at += D * G;
        }
        // The first of the rows was found last, and is waited for last.
        if let Some((nearest, rows)) = self.rows.split_first() {
            let begin = at;
            for &row in rows {
                at += D * G;
                add_transposed::<T, D, G>(&values[at..at + D * G + PADDING], x[row], &mut sums);
            }
            add_transposed::<T, D, G>(&values[begin..begin + D * G + PADDING], x[*nearest], &mut sums);
        }
        // Or the compiler sums across columns from the start, and turns every block for that.
        let sums = std::hint::black_box(sums);
        for (k, out) in x[self.own.start + first..][..G / D].iter_mut().enumerate() {
            let sum = |c: usize| {
                let [a, b, c, _] = sums[3 * k + c].0;
                (a + b) + c
            };
            *out = match D {
                1 => sums[k],
                _ => Lane([sum(0), sum(1), sum(2), 0.0]),
            };
        }
    }
}

/// `sum + Σ_g M_g w_g` for one row node.
#[inline(always)]
fn plus_product<T: Entry, const D: usize, const G: usize>(
    values: &[T],
    w: &[Lane; G],
    mut sum: Lane,
) -> Lane {
    for g in 0..G {
        sum = block::<T, D>(values, g).mul_add(w[g], sum);
    }
    sum
}

/// `sums_g += M_gᵀ v` for one row node, to be summed over the axes at the end.
#[inline(always)]
fn add_transposed<T: Entry, const D: usize, const G: usize>(values: &[T], v: Lane, sums: &mut [Lane; G]) {
    for g in 0..G {
        sums[g] = block::<T, D>(values, g).mul_add(v, sums[g]);
    }
}

/// What a row node has in column g: three numbers for its three unknowns, and the next one, which meets a zero; or
/// one number for all axes.
#[inline(always)]
fn block<T: Entry, const D: usize>(values: &[T], g: usize) -> Lane {
    match D {
        1 => Lane::splat(values[g].into()),
        _ => {
            let numbers = &values[3 * g..3 * g + 4];
            Lane(std::array::from_fn(|l| numbers[l].into()))
        }
    }
}
