//! Pairs of landmarks, and pairs of pairs of equal length.

use super::Options;
use nalgebra::Vector2;

/// The pair of landmarks `from`, `to`, `from < to`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    pub from: u32,
    pub to: u32,
    pub length: f64,
}

/// Segment `a` of the one set and `b` of the other, `b` taken from its end to its start where `swapped`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Equal {
    pub a: Segment,
    pub b: Segment,
    pub swapped: bool,
}

impl Equal {
    /// The landmarks that this pairs: `[(a, b), (a, b)]`.
    pub fn pairs(&self) -> [(usize, usize); 2] {
        let (from, to) = if self.swapped { (self.b.to, self.b.from) } else { (self.b.from, self.b.to) };
        [(self.a.from as usize, from as usize), (self.a.to as usize, to as usize)]
    }

    /// Whether both may be paired.
    pub fn is_allowed(&self, compatible: impl Fn(usize, usize) -> bool) -> bool {
        self.pairs().into_iter().all(|(i, j)| compatible(i, j))
    }
}

/// All segments of a set with a length in the band, shortest first.
pub(super) fn segments(points: &[Vector2<f64>], options: &Options) -> Vec<Segment> {
    let band = options.min_length..=options.max_length;
    let mut all = Vec::with_capacity(points.len() * points.len() / 2);
    for (to, q) in points.iter().enumerate() {
        for (from, p) in points[..to].iter().enumerate() {
            let length = (q - p).norm();
            if band.contains(&length) {
                all.push(Segment { from: from as u32, to: to as u32, length });
            }
        }
    }
    all.sort_unstable_by(|s, t| s.length.total_cmp(&t.length).then((s.to, s.from).cmp(&(t.to, t.from))));
    all
}

/// What `make` makes of segments of a and b whose lengths differ by the tolerance at most, both ways round.
///
/// All of them while they fit the budget; otherwise those of segments of a drawn evenly over the lengths.
pub(super) fn equal_segments<T>(
    a: &[Vector2<f64>],
    b: &[Vector2<f64>],
    options: &Options,
    make: impl Fn(&Equal) -> Option<T>,
) -> Vec<T> {
    let (of_a, of_b) = (segments(a, options), segments(b, options));
    let mut made = Vec::new();
    for k in evenly(of_a.len()) {
        let a = of_a[k];
        let start = of_b.partition_point(|s| s.length < a.length - options.tolerance);
        let near = of_b[start..].iter().take_while(|s| s.length <= a.length + options.tolerance);
        let both = near.flat_map(|&b| [false, true].map(|swapped| Equal { a, b, swapped }));
        made.extend(both.filter_map(|equal| make(&equal)));
        if made.len() >= options.max_motions {
            break;
        }
    }
    made
}

/// The numbers below `n`, each once, in an order whose every beginning is spread evenly (golden section steps).
fn evenly(n: usize) -> impl Iterator<Item = usize> {
    let mut step = (n as f64 * 0.618_033_988_749_895).round().max(1.0) as usize;
    while gcd(step, n) > 1 {
        step += 1;
    }
    (0..n).scan(0, move |at, _| {
        let here = *at;
        *at = (*at + step) % n;
        Some(here)
    })
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evenly_visits_each_once() {
        for n in 0..200 {
            let mut seen: Vec<_> = evenly(n).collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..n).collect::<Vec<_>>());
        }
    }
}
