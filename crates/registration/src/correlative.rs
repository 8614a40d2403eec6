//! Correlative search: the poses at which a scan fits a map best, over a wide window, without a start.
//!
//! The map becomes a field of scores, `exp(-d^2 / 2 sigma^2)` of the distance to the nearest surface point, in eight
//! bits. A pose scores the mean of the field at the scan's points. Branch and bound over translations: level h of the
//! field holds the maximum over squares of `2^h` cells, an upper bound of every pose in the square, so nothing in the
//! window that could be best is missed. All poses within `keep` of the best are searched for, and of those that are
//! close to each other the best is returned, so that ambiguity shows.
//!
//! Source: E. Olson, "Real-time correlative scan matching", ICRA 2009; W. Hess et al., "Real-time loop closure in 2D
//! LIDAR SLAM", ICRA 2016 (bounds by precomputed maxima).

use groma_geometry::Se2;
use nalgebra::Vector2;

/// Two poses closer than this are the same peak [m], [rad].
const SAME_PEAK: (f64, f64) = (0.5, 0.17);
/// Steps of the heading are never finer than this [rad].
const FINEST_STEP: f64 = 0.008;

/// The window of a search.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Its centre.
    pub center: Se2,
    /// Half its edge [m].
    pub reach: f64,
    /// Half its opening [rad].
    pub turn: f64,
}

/// A pose that fits.
#[derive(Clone, Copy, Debug)]
pub struct Peak {
    /// The pose.
    pub pose: Se2,
    /// Mean score of the points, 0..1.
    pub score: f64,
}

/// The map as a pyramid of scores.
#[derive(Clone, Debug)]
pub struct CorrelativeField {
    resolution: f64,
    origin: Vector2<f64>,
    width: i32,
    height: i32,
    levels: Vec<Vec<u8>>,
}

struct Node {
    score: u32,
    level: usize,
    x: i32,
    y: i32,
    heading: usize,
}

impl CorrelativeField {
    /// The field of surface `points`, cells of `resolution` [m], `levels` >= 1 in the pyramid.
    #[must_use]
    pub fn new(points: &[Vector2<f64>], resolution: f64, levels: usize) -> Self {
        let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        for p in points {
            low = low.inf(p);
            high = high.sup(p);
        }
        if points.is_empty() {
            (low, high) = (Vector2::zeros(), Vector2::zeros());
        }
        let margin = (1 << (levels - 1)) as f64 + 3.0;
        let origin = low - Vector2::repeat(margin * resolution);
        let size = (high - origin) / resolution;
        let (width, height) = (size.x as i32 + 4, size.y as i32 + 4);
        let mut field = Self { resolution, origin, width, height, levels: Vec::with_capacity(levels) };
        field.levels.push(field.splat(points));
        for level in 1..levels {
            let coarser = field.widened(level);
            field.levels.push(coarser);
        }
        field
    }

    fn splat(&self, points: &[Vector2<f64>]) -> Vec<u8> {
        let sigma = 0.75; // in cells
        let mut cells = vec![0u8; (self.width * self.height) as usize];
        for p in points {
            let at = (p - self.origin) / self.resolution;
            let (cx, cy) = (at.x.floor() as i32, at.y.floor() as i32);
            for y in (cy - 2).max(0)..=(cy + 2).min(self.height - 1) {
                for x in (cx - 2).max(0)..=(cx + 2).min(self.width - 1) {
                    let (dx, dy) = (f64::from(x) + 0.5 - at.x, f64::from(y) + 0.5 - at.y);
                    let score = (255.0 * (-(dx * dx + dy * dy) / (2.0 * sigma * sigma)).exp()) as u8;
                    let cell = &mut cells[(y * self.width + x) as usize];
                    *cell = (*cell).max(score);
                }
            }
        }
        cells
    }

    /// Level `level`: the maximum over `2^level` cells to the right and up, from the level below.
    fn widened(&self, level: usize) -> Vec<u8> {
        let below = &self.levels[level - 1];
        let (w, h, step) = (self.width as usize, self.height as usize, 1usize << (level - 1));
        let mut cells = below.clone();
        for y in 0..h {
            let row = y * w;
            for x in 0..w.saturating_sub(step) {
                cells[row + x] = cells[row + x].max(below[row + x + step]);
            }
        }
        for y in 0..h.saturating_sub(step) {
            let (lower, upper) = cells.split_at_mut((y + step) * w);
            for (a, b) in lower[y * w..y * w + w].iter_mut().zip(&upper[..w]) {
                *a = (*a).max(*b);
            }
        }
        cells
    }

    /// The peaks within `window` that score at least `least` and at least `keep` times the best, best first.
    #[must_use]
    pub fn search(&self, points: &[Vector2<f64>], window: &Window, least: f64, keep: f64) -> Vec<Peak> {
        if points.is_empty() {
            return Vec::new();
        }
        let search = Search::new(self, points, window);
        search.run(least, keep)
    }
}

/// One search: the scan turned to every heading, as cell indices.
struct Search<'a> {
    field: &'a CorrelativeField,
    window: &'a Window,
    headings: Vec<f64>,
    cells: Vec<(i32, i32)>,
    count: usize,
    reach: i32,
}

impl<'a> Search<'a> {
    fn new(field: &'a CorrelativeField, points: &[Vector2<f64>], window: &'a Window) -> Self {
        let mut distances: Vec<f64> = points.iter().map(|p| p.norm()).collect();
        let far = points.len() * 8 / 10;
        let (_, radius, _) = distances.select_nth_unstable_by(far, f64::total_cmp);
        let step = (field.resolution / radius.max(field.resolution)).max(FINEST_STEP);
        let half = (window.turn / step).ceil().max(0.0);
        let n = half as i32;
        let headings: Vec<f64> =
            (-n..=n).map(|k| if n == 0 { 0.0 } else { window.turn * f64::from(k) / half }).collect();
        let mut cells = Vec::with_capacity(headings.len() * points.len());
        for turn in &headings {
            let pose = Se2 {
                rotation: window.center.rotation * groma_geometry::So2::exp(*turn),
                translation: window.center.translation,
            };
            cells.extend(points.iter().map(|p| {
                let at = (pose.act(*p) - field.origin) / field.resolution;
                (at.x.floor() as i32, at.y.floor() as i32)
            }));
        }
        let reach = (window.reach / field.resolution).ceil() as i32;
        Self { field, window, headings, cells, count: points.len(), reach }
    }

    /// The summed score of a square of translations (an upper bound above level 0).
    fn score(&self, level: usize, heading: usize, dx: i32, dy: i32) -> u32 {
        let cells = &self.field.levels[level];
        let (w, h) = (self.field.width, self.field.height);
        let mut sum = 0;
        for &(cx, cy) in &self.cells[heading * self.count..(heading + 1) * self.count] {
            let (x, y) = (cx + dx, cy + dy);
            if x >= 0 && y >= 0 && x < w && y < h {
                sum += u32::from(cells[(y * w + x) as usize]);
            }
        }
        sum
    }

    fn run(&self, least: f64, keep: f64) -> Vec<Peak> {
        let whole = 255.0 * self.count as f64;
        let floor = (least * whole) as u32;
        let mut best = floor;
        let mut found: Vec<Node> = Vec::new();
        let mut stack = self.roots(floor);
        while let Some(node) = stack.pop() {
            if f64::from(node.score) < keep * f64::from(best) || node.score < floor {
                continue;
            }
            if node.level == 0 {
                best = best.max(node.score);
                found.push(node);
                continue;
            }
            self.split(&node, &mut stack);
        }
        found.retain(|n| f64::from(n.score) >= keep * f64::from(best));
        found.sort_by_key(|n| (std::cmp::Reverse(n.score), n.heading, n.y, n.x));
        self.distinct(&found, whole)
    }

    /// The coarsest squares, the most promising last (a stack).
    fn roots(&self, floor: u32) -> Vec<Node> {
        let level = self.field.levels.len() - 1;
        let step = 1 << level;
        let mut roots = Vec::new();
        for heading in 0..self.headings.len() {
            for y in (-self.reach..=self.reach).step_by(step) {
                for x in (-self.reach..=self.reach).step_by(step) {
                    let score = self.score(level, heading, x, y);
                    if score >= floor {
                        roots.push(Node { score, level, x, y, heading });
                    }
                }
            }
        }
        roots.sort_by_key(|n| (n.score, std::cmp::Reverse((n.heading, n.y, n.x))));
        roots
    }

    fn split(&self, node: &Node, stack: &mut Vec<Node>) {
        let level = node.level - 1;
        let half = 1 << level;
        let mut parts = [(0, 0), (half, 0), (0, half), (half, half)].map(|(dx, dy)| {
            let (x, y) = (node.x + dx, node.y + dy);
            let score = self.score(level, node.heading, x, y);
            Node { score, level, x, y, heading: node.heading }
        });
        parts.sort_by_key(|n| (n.score, std::cmp::Reverse((n.y, n.x))));
        stack.extend(parts);
    }

    fn distinct(&self, found: &[Node], whole: f64) -> Vec<Peak> {
        let mut peaks: Vec<Peak> = Vec::new();
        for n in found {
            let shift = Vector2::new(f64::from(n.x), f64::from(n.y)) * self.field.resolution;
            let pose = Se2 {
                rotation: self.window.center.rotation * groma_geometry::So2::exp(self.headings[n.heading]),
                translation: self.window.center.translation + shift,
            };
            let known = peaks.iter().any(|p| {
                let d = p.pose.between(&pose);
                d.translation.norm() < SAME_PEAK.0 && d.theta().abs() < SAME_PEAK.1
            });
            if !known {
                peaks.push(Peak { pose, score: f64::from(n.score) / whole });
            }
        }
        peaks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An L-shaped room with a niche: no symmetry.
    fn room() -> Vec<Vector2<f64>> {
        let corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 2.0), (3.0, 2.0), (3.0, 2.7), (2.0, 2.7), (2.0, 4.0), (0.0, 4.0)];
        let mut points = Vec::new();
        for k in 0..corners.len() {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            let (a, b) = (Vector2::new(a.0, a.1), Vector2::new(b.0, b.1));
            let n = ((b - a).norm() / 0.05) as usize;
            points.extend((0..n).map(|i| a + (b - a) * (i as f64 / n as f64)));
        }
        points
    }

    #[test]
    fn finds_a_pose_far_from_the_centre_of_the_window() {
        let points = room();
        let field = CorrelativeField::new(&points, 0.1, 4);
        let truth = Se2::new(1.3, -0.8, 0.5);
        let scan: Vec<_> = points.iter().map(|p| truth.inverse().act(*p)).collect();
        let window = Window { center: Se2::IDENTITY, reach: 2.0, turn: 0.7 };
        let peaks = field.search(&scan, &window, 0.2, 0.9);
        let error = truth.between(&peaks[0].pose);
        assert!(error.translation.norm() < 0.1 && error.theta().abs() < 0.03, "{error:?}");
    }

    #[test]
    fn bounds_miss_nothing() {
        let points = room();
        let truth = Se2::new(0.4, 0.3, -0.2);
        let scan: Vec<_> = points.iter().step_by(3).map(|p| truth.inverse().act(*p)).collect();
        let window = Window { center: Se2::new(0.1, -0.1, 0.05), reach: 0.7, turn: 0.4 };
        let plain = CorrelativeField::new(&points, 0.1, 1).search(&scan, &window, 0.0, 1.0);
        let bounded = CorrelativeField::new(&points, 0.1, 4).search(&scan, &window, 0.0, 1.0);
        assert!((plain[0].score - bounded[0].score).abs() < 1e-12);
    }

    #[test]
    fn ambiguity_shows_as_two_peaks() {
        // Two parallel walls with identical combs of niches: shifting by one niche fits as well.
        let mut points = Vec::new();
        for k in 0..400 {
            let x = f64::from(k) * 0.05;
            let y = if (k / 20) % 2 == 0 { 1.0 } else { 1.3 };
            points.push(Vector2::new(x, y));
            points.push(Vector2::new(x, -1.0));
        }
        let field = CorrelativeField::new(&points, 0.1, 4);
        let scan: Vec<_> = points.iter().filter(|p| p.x > 6.0 && p.x < 12.0).copied().collect();
        let peaks = field.search(&scan, &Window { center: Se2::IDENTITY, reach: 3.0, turn: 0.1 }, 0.3, 0.9);
        assert!(peaks.len() >= 3, "{peaks:?}");
    }

    #[test]
    fn nothing_to_match_gives_no_peaks() {
        let window = Window { center: Se2::IDENTITY, reach: 1.0, turn: 0.5 };
        assert!(CorrelativeField::new(&[], 0.1, 3).search(&room(), &window, 0.1, 0.9).is_empty());
        assert!(CorrelativeField::new(&room(), 0.1, 3).search(&[], &window, 0.1, 0.9).is_empty());
    }
}
