//! The filter's pass over the stops: births, gates, moved cameras.

use super::alarm::{Moved, Watch};
use super::judged::{Judged, Verdict};
use super::{Halt, Seen, Survey};
use crate::batch::Lens;
use crate::options::Options;
use crate::view::{Fit, Sighting};
use crate::{Error, NetworkFilter, View};
use groma_estimation::chi_square::quantile;
use groma_geometry::{LieGroup, Se3};
use groma_models::Token;
use nalgebra::{DMatrix, DVector};

/// Degrees of freedom of a view.
const VIEW_DOF: usize = 6;

/// A place where a camera is, or was until it was moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Number of the camera.
    pub camera: usize,
    /// Number of the stop from which on it is there.
    pub since: usize,
}

/// What the pass leaves. Places are numbered as the filter numbers its cameras.
pub(super) struct Filtered {
    pub filter: NetworkFilter,
    pub places: Vec<Place>,
    pub judged: Vec<Judged>,
    /// `Z` of each judged view, as it was taken.
    pub poses: Vec<Se3>,
    pub moved: Vec<Moved>,
}

pub(super) fn run(
    survey: &Survey,
    lenses: &[Lens],
    halts: &[Halt],
    options: &Options,
    token: &Token,
) -> Result<Filtered, Error> {
    let root = DMatrix::from_diagonal(&DVector::from_row_slice(&options.mount.sigmas()));
    let filter = NetworkFilter::new(Se3::identity(), &root, options.odometry, options.floor);
    let filtered = Filtered { filter, places: vec![], judged: vec![], poses: vec![], moved: vec![] };
    let mut pass = Pass {
        lenses,
        options,
        gate: quantile(options.gate, VIEW_DOF),
        current: vec![None; survey.cameras.len()],
        watch: Watch::new(survey.cameras.len()),
        done: filtered,
    };
    token.begin(halts.len());
    for (number, halt) in halts.iter().enumerate() {
        token.step()?;
        for step in &halt.steps {
            pass.done.filter.drive(step)?;
        }
        pass.done.filter.stop()?;
        for seen in &halt.seen {
            token.check()?;
            pass.take(number, seen)?;
        }
    }
    Ok(pass.done)
}

struct Pass<'a> {
    lenses: &'a [Lens],
    options: &'a Options,
    gate: f64,
    /// The place where each camera is now.
    current: Vec<Option<usize>>,
    watch: Watch,
    done: Filtered,
}

impl Pass<'_> {
    fn take(&mut self, stop: usize, seen: &Seen) -> Result<(), Error> {
        let lens = &self.lenses[seen.camera];
        let used = self.current[seen.camera]
            .map_or_else(|| DVector::zeros(lens.basis.ncols()), |p| self.done.filter.cameras()[p].calibration.clone());
        let Some(sighting) = Sighting::new(&lens.calibrated(&used), &lens.basis, &seen.corners) else {
            self.judge(stop, seen.camera, None, f64::NAN, Verdict::NoPose, None);
            return Ok(());
        };
        match self.current[seen.camera] {
            None => self.first_sight(stop, seen.camera, &sighting, &used),
            Some(place) => self.again(stop, seen.camera, place, &sighting, &used),
        }
    }

    fn first_sight(&mut self, stop: usize, camera: usize, s: &Sighting, used: &DVector<f64>) -> Result<(), Error> {
        if !s.is_decided() {
            self.judge(stop, camera, None, f64::NAN, Verdict::Undecided, None);
            return Ok(());
        }
        let place = self.birth(stop, camera, &self.view(&s.fits[0], used))?;
        self.judge(stop, camera, Some(place), 0.0, Verdict::Born, Some(s.fits[0].pose));
        Ok(())
    }

    fn birth(&mut self, stop: usize, camera: usize, view: &View) -> Result<usize, Error> {
        let m = view.sensitivity.ncols();
        let place = self.done.filter.birth(view, &DMatrix::identity(m, m))?;
        self.done.places.push(Place { camera, since: stop });
        self.current[camera] = Some(place);
        Ok(place)
    }

    fn again(
        &mut self,
        stop: usize,
        camera: usize,
        place: usize,
        s: &Sighting,
        used: &DVector<f64>,
    ) -> Result<(), Error> {
        let mut best: Option<(f64, View)> = None;
        for fit in &s.fits {
            let view = self.view(fit, used);
            let nis = self.done.filter.innovation(place, &view)?.nis;
            if best.as_ref().is_none_or(|(least, _)| nis < *least) {
                best = Some((nis, view));
            }
        }
        let Some((nis, view)) = best else { return Ok(()) };
        if nis <= self.gate {
            self.done.filter.update(place, &view)?;
            self.watch.agrees(camera);
            self.judge(stop, camera, Some(place), nis, Verdict::Taken, Some(view.pose));
            return Ok(());
        }
        self.judge(stop, camera, Some(place), nis, Verdict::Rejected, Some(view.pose));
        self.watch.disagrees(camera, self.done.judged.len() - 1);
        if self.watch.rejected(camera).len() >= self.options.moved_after && s.is_decided() {
            self.settle_anew(stop, camera, place, &view)?;
        }
        Ok(())
    }

    /// The camera has been moved: it gets a new place, and the views that told so belong to it.
    fn settle_anew(&mut self, stop: usize, camera: usize, old: usize, view: &View) -> Result<(), Error> {
        let place = self.birth(stop, camera, view)?;
        let rejected = self.watch.rejected(camera).to_vec();
        for &k in &rejected {
            let verdict = if k + 1 == self.done.judged.len() { Verdict::Born } else { Verdict::Taken };
            let judged = &mut self.done.judged[k];
            (judged.place, judged.verdict) = (Some(place), verdict);
        }
        self.done.places[place].since = self.done.judged[rejected[0]].stop;
        self.done.moved.push(Moved { camera, from: old, to: place });
        self.watch.agrees(camera);
        Ok(())
    }

    fn view(&self, fit: &Fit, used: &DVector<f64>) -> View {
        fit.view([self.options.view.position, self.options.view.rotation], used)
    }

    fn judge(
        &mut self,
        stop: usize,
        camera: usize,
        place: Option<usize>,
        nis: f64,
        verdict: Verdict,
        pose: Option<Se3>,
    ) {
        self.done.judged.push(Judged { stop, camera, place, nis, verdict });
        self.done.poses.push(pose.unwrap_or_else(Se3::identity));
    }
}
