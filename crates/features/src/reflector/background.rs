//! How bright diffuse surfaces are in a scan, against range.
//!
//! The hits with a positive intensity (of many, every so many) are cut by range into groups of equal size; of each group counts the
//! median of the intensities, as a logarithm, at the median of the ranges. A group may be full of one large reflector close by, so
//! the level of a group is the median of its own and its neighbours'. Between groups the level is interpolated over ln r,
//! beyond the first and last it stays. The spread is the upper quartile of all logarithms above their level: diffuse
//! surfaces differ upwards by reflectivity alone (and by little), downwards by grazing incidence as well.
//!
//! Echoes are sorted as integers: those of the bits of positive numbers rise as the numbers do. Single precision is plenty for
//! a level.

/// Groups of hits, at most.
const MOST_GROUPS: usize = 12;
/// Hits of a group, at least.
const LEAST_HITS: usize = 16;
/// Hits that are looked at, at most.
const MOST_HITS: usize = 2 * MOST_GROUPS * LEAST_HITS;

/// Level and spread of the diffuse echoes of one scan.
#[derive(Clone, Debug, Default)]
pub(super) struct Background {
    /// ln range and ln intensity of the groups, by range.
    levels: Vec<(f64, f64)>,
    spread: f64,
    /// Ranges of the groups, and below which intensity nothing is bright before the first, between two and after the last.
    ranges: Vec<f64>,
    dark: Vec<f64>,
    /// The least of `dark`.
    darkest: f64,
    /// What counts for the level.
    lit: Vec<Echo>,
    intensities: Vec<u32>,
    excesses: Vec<f64>,
}

/// Range and intensity, both positive, as a number that rises with the range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Echo(u64);

impl Echo {
    fn new(range: f64, intensity: f64) -> Option<Self> {
        let (range, intensity) = (range as f32, intensity as f32);
        let counts = range > 0.0 && intensity > 0.0 && intensity.is_finite();
        counts.then(|| Self(u64::from(range.to_bits()) << 32 | u64::from(intensity.to_bits())))
    }

    fn range(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    /// The bits of the intensity.
    fn intensity(self) -> u32 {
        self.0 as u32
    }
}

impl Background {
    /// Takes a scan; false where too few echoes have an intensity. `echoes` are range and intensity of every hit.
    pub fn learn(&mut self, echoes: impl Iterator<Item = (f64, f64)>) -> bool {
        self.lit.clear();
        self.lit.extend(echoes.filter_map(|(range, intensity)| Echo::new(range, intensity)));
        if self.lit.len() < LEAST_HITS {
            return false;
        }
        self.thin();
        self.find_levels();
        self.find_spread();
        true
    }

    /// By how much the logarithm of an intensity at `range` exceeds what a diffuse surface sends back.
    pub fn excess(&self, range: f64, intensity: f64) -> f64 {
        if intensity > 0.0 { intensity.ln() - level(&self.levels, range.ln()) } else { f64::NEG_INFINITY }
    }

    /// How far diffuse surfaces differ upwards (upper quartile of the logarithm).
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// Prepares [`Self::may_exceed`] for an excess.
    pub fn expect(&mut self, least: f64) {
        let level = |k: usize| self.levels.get(k).map_or(f64::INFINITY, |l| l.1);
        self.ranges.clear();
        self.ranges.extend(self.levels.iter().map(|l| l.0.exp() * (1.0 - 1e-9)));
        self.dark.clear();
        let between = |k: usize| k.checked_sub(1).map_or(f64::INFINITY, level).min(level(k));
        let lowest = |k: usize| between(k).min(k.checked_sub(1).map_or(f64::INFINITY, between));
        self.dark.extend((0..=self.levels.len()).map(|k| (lowest(k) + least).exp() * (1.0 - 1e-9)));
        self.darkest = self.dark.iter().copied().fold(f64::INFINITY, f64::min);
    }

    /// Whether an echo may be as bright as expected: a bound that needs no logarithm.
    pub fn may_exceed(&self, range: f64, intensity: f64) -> bool {
        intensity >= self.darkest && intensity >= self.dark[self.ranges.iter().filter(|r| **r <= range).count()]
    }

    /// Of many echoes every so many tell as much.
    fn thin(&mut self) {
        let stride = self.lit.len().div_ceil(MOST_HITS);
        let kept = self.lit.len().div_ceil(stride);
        (0..kept).for_each(|k| self.lit[k] = self.lit[k * stride]);
        self.lit.truncate(kept);
    }

    fn find_levels(&mut self) {
        let Self { lit, intensities, levels, .. } = self;
        let groups = groups_of(lit.len());
        let bounds: Vec<usize> = (1..groups).map(|g| bound(g, lit.len())).collect();
        split(lit, &bounds, 0);
        let count = lit.len();
        let mut median = |g: usize| {
            let group = &mut lit[bound(g, count)..bound(g + 1, count)];
            intensities.clear();
            intensities.extend(group.iter().map(|echo| echo.intensity()));
            let middle = group.len() / 2;
            let range = group.select_nth_unstable(middle).1.range();
            let k = (intensities.len() - 1) / 2;
            let intensity = f32::from_bits(*intensities.select_nth_unstable(k).1);
            (f64::from(range).ln(), f64::from(intensity).ln())
        };
        let medians: Vec<(f64, f64)> = (0..groups).map(&mut median).collect();
        *levels = smoothed(&medians);
    }

    fn find_spread(&mut self) {
        let Self { lit, excesses, levels, .. } = self;
        let count = lit.len();
        excesses.clear();
        for g in 0..levels.len() {
            // A group lies around its own level.
            excesses.extend(lit[bound(g, count)..bound(g + 1, count)].iter().map(|echo| {
                let ln_range = echo.range().ln().into();
                let after = if levels[g].0 <= ln_range { g + 1 } else { g };
                f64::from(f32::from_bits(echo.intensity()).ln()) - interpolated(levels, after, ln_range)
            }));
        }
        self.spread = quantile(excesses, 0.75).max(0.0);
    }
}

fn groups_of(count: usize) -> usize {
    (count / LEAST_HITS).min(MOST_GROUPS)
}

/// Where a group begins among so many echoes.
fn bound(group: usize, count: usize) -> usize {
    group * count / groups_of(count)
}

/// Puts echoes into groups of rising range that end at `bounds`, counted from `first`.
fn split(echoes: &mut [Echo], bounds: &[usize], first: usize) {
    let Some(&bound) = bounds.get(bounds.len() / 2) else { return };
    echoes.select_nth_unstable(bound - first);
    let (near, far) = echoes.split_at_mut(bound - first);
    split(near, &bounds[..bounds.len() / 2], first);
    split(far, &bounds[bounds.len() / 2 + 1..], bound);
}

fn level(levels: &[(f64, f64)], ln_range: f64) -> f64 {
    interpolated(levels, levels.partition_point(|&(r, _)| r <= ln_range), ln_range)
}

/// The level at a range before the group `after`, and not before the one before that.
fn interpolated(levels: &[(f64, f64)], after: usize, ln_range: f64) -> f64 {
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
        let mut background = Background::default();
        background.learn(hits).then_some(background)
    }

    #[test]
    fn the_level_follows_the_range_and_ignores_reflectors() {
        let diffuse = |r: f64| 1000.0 / (r * r);
        // From 4 m on light falls off by less than the bound from one group to the next.
        let ranges = (0..400).map(|k| 4.0 + 0.05 * f64::from(k));
        let hits = ranges.map(|r| (r, if (10.0..11.0).contains(&r) { 50.0 * diffuse(r) } else { diffuse(r) }));
        let background = learned(hits).unwrap();
        for r in [7.0, 10.5, 14.0, 21.0] {
            assert!(background.excess(r, diffuse(r)).abs() < 0.4, "{r}");
            assert!((background.excess(r, 50.0 * diffuse(r)) - 50_f64.ln()).abs() < 0.4, "{r}");
        }
        assert!(background.spread() < 0.3);
    }

    #[test]
    fn the_quick_bound_never_hides_what_is_bright() {
        let hits = || (0..900).map(|k| (1.0 + f64::from(k * 37 % 900) / 40.0, 80.0 + f64::from(k * 13 % 57)));
        let mut background = learned(hits().map(|(r, i)| (r, i / r.sqrt()))).unwrap();
        for least in [0.1, 0.7, 2.0] {
            background.expect(least);
            let mut quick = 0;
            for k in 0..4000 {
                let (r, i) = (0.4 + f64::from(k) / 130.0, 3.0 * f64::from(k * 7 % 331));
                assert!(background.may_exceed(r, i) || background.excess(r, i) < least, "{r} {i}");
                quick += usize::from(!background.may_exceed(r, i));
            }
            assert!(quick > 100, "it spares something");
        }
    }

    #[test]
    fn too_few_echoes_give_no_level() {
        assert!(learned((0..15).map(|_| (1.0, 1.0))).is_none());
        assert!(learned((0..100).map(|_| (1.0, 0.0))).is_none());
        assert!(learned((0..100).map(|_| (1.0, f64::NAN))).is_none());
    }

    #[test]
    fn nothing_is_left_of_the_scan_before() {
        let mut background = Background::default();
        assert!(background.learn((0..200).map(|k| (2.0 + 0.01 * f64::from(k), 900.0))));
        let scan = || (0..100).map(|k| (3.0 + 0.01 * f64::from(k), 100.0 + f64::from(k % 5)));
        assert!(background.learn(scan()));
        let fresh = learned(scan()).unwrap();
        assert!(scan().all(|(r, i)| background.excess(r, i).to_bits() == fresh.excess(r, i).to_bits()));
        assert_eq!(background.spread(), fresh.spread());
    }
}
