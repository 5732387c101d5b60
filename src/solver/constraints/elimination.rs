//! An order in which a block matrix is eliminated so that its factor fills in little.

/// Approximates a minimum degree order; keeps it while the graph stays the same.
#[derive(Default)]
pub(super) struct Elimination {
    /// Which blocks touch, row by row; with the fill once the order is there.
    adjacent: Vec<bool>,
    /// Place of each block, and the block at each place.
    pub rank: Vec<usize>,
    pub order: Vec<usize>,
    /// What the order was made for.
    known: (Vec<usize>, Vec<bool>),
    known_first: Vec<bool>,
    graph: Vec<bool>,
    eliminated: Vec<bool>,
    /// Rows of each block and of those adjacent to it, as far as they are not eliminated.
    degrees: Vec<usize>,
    near: Vec<usize>,
}

impl Elimination {
    /// Begins a graph of so many blocks, each adjacent to itself.
    pub fn begin(&mut self, blocks: usize) {
        self.graph.clear();
        self.graph.resize(blocks * blocks, false);
        (0..blocks).for_each(|b| self.graph[b * blocks + b] = true);
    }

    pub fn connect(&mut self, a: usize, b: usize) {
        let blocks = self.graph.len().isqrt();
        self.graph[a * blocks + b] = true;
        self.graph[b * blocks + a] = true;
    }

    /// The blocks that come `first` before the others; of either the least degree first, counted in rows of these
    /// `sizes`; ties by index.
    pub fn arrange(&mut self, sizes: &[usize], first: &[bool]) {
        if self.known.0 == sizes && self.known.1 == self.graph && self.known_first == first {
            return;
        }
        self.known_first.clear();
        self.known_first.extend_from_slice(first);
        self.known.0.clear();
        self.known.0.extend_from_slice(sizes);
        self.known.1.clone_from(&self.graph);
        self.adjacent.clone_from(&self.graph);
        let Self { adjacent, eliminated, degrees, near, rank, order, .. } = self;
        let blocks = sizes.len();
        eliminated.clear();
        eliminated.resize(blocks, false);
        degrees.clear();
        for row in adjacent.chunks(blocks.max(1)) {
            degrees.push(row.iter().zip(sizes).filter(|(a, _)| **a).map(|(_, size)| size).sum());
        }
        rank.clear();
        rank.resize(blocks, 0);
        order.clear();
        let firsts = first.iter().filter(|is_first| **is_first).count();
        for place in 0..blocks {
            let open = (0..blocks).filter(|&b| !eliminated[b] && (place >= firsts || first[b]));
            let Some(next) = open.min_by_key(|&b| (degrees[b], b)) else { break };
            rank[next] = place;
            order.push(next);
            eliminated[next] = true;
            near.clear();
            near.extend((0..blocks).filter(|&b| adjacent[next * blocks + b] && !eliminated[b]));
            for &a in &*near {
                degrees[a] -= sizes[next];
                for &b in &*near {
                    if !std::mem::replace(&mut adjacent[a * blocks + b], true) {
                        degrees[a] += sizes[b];
                    }
                }
            }
        }
    }

    /// Lists the pairs (row, column) of the lower triangle that the factor fills, in the new order.
    pub fn list_filled(&self, filled: &mut Vec<(usize, usize)>) {
        let blocks = self.order.len();
        filled.clear();
        for j in 0..blocks {
            let column = &self.adjacent[self.order[j] * blocks..][..blocks];
            filled.extend((j..blocks).filter(|&i| column[self.order[i]]).map(|i| (i, j)));
        }
    }
}
