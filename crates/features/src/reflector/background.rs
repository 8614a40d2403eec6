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

/// Level and spread of the diffuse echoes of one scan.
#[derive(Clone, Debug)]
pub(super) struct Background {
    /// ln range and ln intensity of the groups, by range.
    levels: Vec<(f64, f64)>,
    spread: f64,
}

impl Background {
    /// Of hits `(range, intensity)`; none where too few have an intensity.
    pub fn of(hits: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let bright = |&(r, i): &(f64, f64)| r > 0.0 && i > 0.0 && i.is_finite();
        let mut logs: Vec<(f64, f64)> = hits.filter(bright).map(|(r, i)| (r.ln(), i.ln())).collect();
        if logs.len() < LEAST_HITS {
            return None;
        }
        logs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let groups = (logs.len() / LEAST_HITS).min(MOST_GROUPS);
        let medians: Vec<(f64, f64)> = (0..groups)
            .map(|g| &logs[g * logs.len() / groups..(g + 1) * logs.len() / groups])
            .map(|group| (group[group.len() / 2].0, quantile(group.iter().map(|g| g.1), 0.5)))
            .collect();
        let mut background = Self { levels: smoothed(&medians), spread: 0.0 };
        background.spread = quantile(logs.iter().map(|&(r, i)| i - background.level(r)), 0.75).max(0.0);
        Some(background)
    }

    /// By how much the logarithm of an intensity at `range` exceeds what a diffuse surface sends back.
    pub fn excess(&self, range: f64, intensity: f64) -> f64 {
        if intensity > 0.0 { intensity.ln() - self.level(range.ln()) } else { f64::NEG_INFINITY }
    }

    /// How far diffuse surfaces differ upwards (upper quartile of the logarithm).
    pub fn spread(&self) -> f64 {
        self.spread
    }

    fn level(&self, ln_range: f64) -> f64 {
        let after = self.levels.partition_point(|&(r, _)| r <= ln_range);
        let clamped = |k: usize| self.levels[k.min(self.levels.len() - 1)];
        let ((r0, l0), (r1, l1)) = (clamped(after.saturating_sub(1)), clamped(after));
        if r1 > r0 { l0 + (l1 - l0) * ((ln_range - r0) / (r1 - r0)).clamp(0.0, 1.0) } else { l0 }
    }
}

/// Each level replaced by the median of three.
fn smoothed(medians: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let first_of_three = |k: usize| k.saturating_sub(1).min(medians.len().saturating_sub(3));
    let level = |k: usize| {
        let first = first_of_three(k);
        quantile(medians[first..medians.len().min(first + 3)].iter().map(|m| m.1), 0.5)
    };
    medians.iter().enumerate().map(|(k, m)| (m.0, level(k))).collect()
}

/// The value below which a share of the values lies; values must not be empty.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let k = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_follows_the_range_and_ignores_reflectors() {
        let diffuse = |r: f64| 1000.0 / (r * r);
        // From 4 m on light falls off by less than the bound from one group to the next.
        let ranges = (0..400).map(|k| 4.0 + 0.05 * f64::from(k));
        let hits = ranges.map(|r| (r, if (10.0..11.0).contains(&r) { 50.0 * diffuse(r) } else { diffuse(r) }));
        let background = Background::of(hits).unwrap();
        for r in [7.0, 10.5, 14.0, 21.0] {
            assert!(background.excess(r, diffuse(r)).abs() < 0.4, "{r}");
            assert!((background.excess(r, 50.0 * diffuse(r)) - 50_f64.ln()).abs() < 0.4, "{r}");
        }
        assert!(background.spread() < 0.3);
    }

    #[test]
    fn too_few_echoes_tell_nothing() {
        assert!(Background::of((0..15).map(|_| (1.0, 1.0))).is_none());
        assert!(Background::of((0..100).map(|_| (1.0, 0.0))).is_none());
        assert!(Background::of((0..100).map(|_| (1.0, f64::NAN))).is_none());
    }
}
