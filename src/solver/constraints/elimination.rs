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
    known: Known,
    graph: Vec<bool>,
    eliminated: Vec<bool>,
    /// Rows of each block and of those adjacent to it, as far as they are not eliminated.
    degrees: Vec<usize>,
    near: Vec<usize>,
}

/// What an order was made for.
#[derive(Default)]
struct Known {
    sizes: Vec<usize>,
    graph: Vec<bool>,
    first: Vec<bool>,
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
        let known = &mut self.known;
        if known.sizes == sizes && known.graph == self.graph && known.first == first {
            return;
        }
        known.first.clear();
        known.first.extend_from_slice(first);
        known.sizes.clear();
        known.sizes.extend_from_slice(sizes);
        known.graph.clone_from(&self.graph);
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
