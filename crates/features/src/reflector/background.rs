//! How bright diffuse surfaces are in a scan, against range.
//!
//! The hits with a positive intensity are sorted by range and cut into groups of equal size; of each group counts the
//! median of the logarithms at the median of the ranges. A group may be full of one large reflector close by, so the
//! level of a group is the median of its own and its neighbours'. Between groups the level is interpolated over ln r,
//! beyond the first and last it stays. The spread is the upper quartile of all logarithms above their level: diffuse
//! surfaces differ upwards by reflectivity alone (and by little), downwards by grazing incidence as well.

/// Groups of hits, at most.
const MOST_GROUPS: usize = 12;
/// Hits of a group, at least.
const LEAST_HITS: usize = 16;

/// Level and spread of the diffuse echoes of one scan, and by how much each echo exceeds the level.
#[derive(Clone, Debug, Default)]
pub(super) struct Background {
    /// ln range and ln intensity of the groups, by range.
    levels: Vec<(f64, f64)>,
    spread: f64,
    /// Of every beam; minus infinity where there is no echo.
    excesses: Vec<f64>,
    /// Bits of the range, which rise with it, and ln intensity of what counts for the level.
    lit: Vec<(u64, f64)>,
    work: Vec<f64>,
}

impl Background {
    /// Takes a scan; false where too few echoes have an intensity. `echoes` are range and intensity of every beam, none where
    /// there is no hit.
    pub fn learn(&mut self, echoes: impl Iterator<Item = Option<(f64, f64)>> + Clone) -> bool {
        let counts = |&(r, i): &(f64, f64)| r > 0.0 && i > 0.0 && i.is_finite();
        self.lit.clear();
        self.lit.extend(echoes.clone().flatten().filter(counts).map(|(r, i)| (r.to_bits(), i.ln())));
        if self.lit.len() < LEAST_HITS {
            return false;
        }
        self.find_levels();
        let level = |r: f64| level(&self.levels, r.ln());
        let excess = |(r, i): (f64, f64)| if i > 0.0 { i.ln() - level(r) } else { f64::NEG_INFINITY };
        self.excesses.clear();
        self.excesses.extend(echoes.map(|echo| echo.map_or(f64::NEG_INFINITY, excess)));
        self.work.clear();
        self.work.extend(self.excesses.iter().filter(|e| e.is_finite()));
        self.spread = quantile(&mut self.work, 0.75).max(0.0);
        true
    }

    /// By how much the logarithm of the intensity of a beam exceeds what a diffuse surface sends back.
    pub fn excess(&self, beam: usize) -> f64 {
        self.excesses[beam]
    }

    /// How far diffuse surfaces differ upwards (upper quartile of the logarithm).
    pub fn spread(&self) -> f64 {
        self.spread
    }

    fn find_levels(&mut self) {
        let Self { lit, work, levels, .. } = self;
        lit.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let groups = (lit.len() / LEAST_HITS).min(MOST_GROUPS);
        let median = |g: usize| {
            let group = &lit[g * lit.len() / groups..(g + 1) * lit.len() / groups];
            work.clear();
            work.extend(group.iter().map(|e| e.1));
            (f64::from_bits(group[group.len() / 2].0).ln(), quantile(work, 0.5))
        };
        let medians: Vec<(f64, f64)> = (0..groups).map(median).collect();
        *levels = smoothed(&medians);
    }
}

fn level(levels: &[(f64, f64)], ln_range: f64) -> f64 {
    let after = levels.partition_point(|&(r, _)| r <= ln_range);
    let clamped = |k: usize| levels[k.min(levels.len() - 1)];
    let ((r0, l0), (r1, l1)) = (clamped(after.saturating_sub(1)), clamped(after));
    if r1 > r0 { l0 + (l1 - l0) * ((ln_range - r0) / (r1 - r0)).clamp(0.0, 1.0) } else { l0 }
}

/// Each level replaced by the median of three.
fn smoothed(medians: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let first_of_three = |k: usize| k.saturating_sub(1).min(medians.len().saturating_sub(3));
    let level = |k: usize| {
        let first = first_of_three(k);
        let mut three: Vec<f64> = medians[first..medians.len().min(first + 3)].iter().map(|m| m.1).collect();
        quantile(&mut three, 0.5)
    };
    medians.iter().enumerate().map(|(k, m)| (m.0, level(k))).collect()
}

/// The value below which a share of the values lies, which are put into another order; they must not be empty.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    let k = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn learned(hits: impl Iterator<Item = (f64, f64)>) -> Option<Background> {
        let echoes: Vec<_> = hits.map(Some).collect();
        let mut background = Background::default();
        background.learn(echoes.into_iter()).then_some(background)
    }

    #[test]
    fn the_level_follows_the_range_and_ignores_reflectors() {
        let diffuse = |r: f64| 1000.0 / (r * r);
        // From 4 m on light falls off by less than the bound from one group to the next.
        let range = |k: usize| 4.0 + 0.05 * k as f64;
        let bright = |r: f64| (10.0..11.0).contains(&r);
        let hits = (0..400).map(range).map(|r| (r, if bright(r) { 50.0 * diffuse(r) } else { diffuse(r) }));
        let background = learned(hits).unwrap();
        for k in 60..340 {
            let expected = if bright(range(k)) { 50_f64.ln() } else { 0.0 };
            assert!((background.excess(k) - expected).abs() < 0.4, "{k}");
        }
        assert!(background.spread() < 0.3);
    }

    #[test]
    fn too_few_echoes_tell_nothing() {
        assert!(learned((0..15).map(|_| (1.0, 1.0))).is_none());
        assert!(learned((0..100).map(|_| (1.0, 0.0))).is_none());
        assert!(learned((0..100).map(|_| (1.0, f64::NAN))).is_none());
    }

    #[test]
    fn nothing_is_left_of_the_scan_before() {
        let mut background = Background::default();
        assert!(background.learn((0..200).map(|k| Some((2.0 + 0.01 * f64::from(k), 900.0)))));
        let scan = || (0..100).map(|k| (k % 3 != 0).then_some((3.0 + 0.01 * f64::from(k), 100.0 + f64::from(k % 5))));
        assert!(background.learn(scan()));
        let mut fresh = Background::default();
        assert!(fresh.learn(scan()));
        assert!((0..100).all(|k| background.excess(k).to_bits() == fresh.excess(k).to_bits()));
        assert_eq!((background.spread(), background.excess(3)), (fresh.spread(), f64::NEG_INFINITY));
    }
}
