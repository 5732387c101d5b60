//! Where the name of a point is written: clear of every marker, of other names and of the frame, off the lines if
//! there is room.

/// A rectangle in pixels, y downward.
#[derive(Clone, Copy)]
pub struct Area {
    pub low: [f64; 2],
    pub high: [f64; 2],
}

impl Area {
    pub fn around(center: [f64; 2], half: [f64; 2]) -> Self {
        let corner = |sign: f64| [0, 1].map(|k| center[k] + sign * half[k]);
        Self { low: corner(-1.0), high: corner(1.0) }
    }

    pub fn center(&self) -> [f64; 2] {
        [0, 1].map(|k| 0.5 * (self.low[k] + self.high[k]))
    }

    fn touches(&self, other: &Self) -> bool {
        (0..2).all(|k| self.low[k] < other.high[k] && other.low[k] < self.high[k])
    }

    fn is_inside(&self, outer: &Self) -> bool {
        (0..2).all(|k| self.low[k] >= outer.low[k] && self.high[k] <= outer.high[k])
    }

    /// Whether a segment runs through, to a pixel.
    fn is_crossed(&self, [from, to]: [[f64; 2]; 2]) -> bool {
        let count = (to[0] - from[0]).hypot(to[1] - from[1]).ceil().max(1.0);
        (0..=count as usize).any(|i| {
            let at = [0, 1].map(|k| from[k] + (to[k] - from[k]) * i as f64 / count);
            (0..2).all(|k| at[k] > self.low[k] && at[k] < self.high[k])
        })
    }
}

/// What names have to share a panel with.
pub struct Labels {
    pub frame: Area,
    pub markers: Vec<Area>,
    pub lines: Vec<[[f64; 2]; 2]>,
    pub placed: Vec<Area>,
}

impl Labels {
    /// A place for a name of that half size near a point: the nearest that covers nothing.
    pub fn place(&mut self, point: [f64; 2], half: [f64; 2]) -> Area {
        let mut best = (f64::INFINITY, Area::around(point, half));
        for ring in 0..14 {
            for turn in 0..32 {
                let (distance, angle) =
                    (11.0 + 5.0 * f64::from(ring), f64::from(turn) * std::f64::consts::PI / 16.0);
                let direction = [angle.cos(), angle.sin()];
                // The side that faces the point is at the distance, not the centre.
                let center = [0, 1].map(|k| point[k] + direction[k] * (distance + half[k]));
                let area = Area::around(center, half);
                let cost = distance + self.cost(point, &area);
                if cost < best.0 {
                    best = (cost, area);
                }
            }
        }
        self.placed.push(best.1);
        best.1
    }

    /// In pixels of distance that a place may be farther away for.
    fn cost(&self, point: [f64; 2], area: &Area) -> f64 {
        let outside = if area.is_inside(&self.frame) { 0.0 } else { 1e4 };
        let covered = self.markers.iter().chain(&self.placed).filter(|other| area.touches(other)).count();
        let crossed = self.lines.iter().filter(|line| area.is_crossed(**line)).count();
        let leader = [point, area.center()];
        let through = self.placed.iter().filter(|other| other.is_crossed(leader)).count();
        outside + 1e3 * covered as f64 + 60.0 * crossed as f64 + 200.0 * through as f64
    }
}
