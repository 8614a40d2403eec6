//! Looking for the place during the drive: collect what is seen, try now and then.

use crate::observation::Observation;
use crate::relocalize::{LocalView, Located, Relocalizer};
use crate::walls::Walls;
use groma_geometry::Se2;
use groma_models::LaserScan;
use nalgebra::Vector3;
use std::sync::Arc;

/// Landmarks without which it is not worth a try.
const LEAST: usize = 4;
/// Distance between two tries [m]; at a standstill, this many new landmarks, and half as many as there were.
const APART: f64 = 0.5;
/// By this share of it longer after every try in vain, up to this: where the map ends, tries are wasted [m].
const LONGER: (f64, f64) = (0.1, 3.0);
const MORE: usize = 3;
/// Probability of being wrong below which a place is taken at once; else it must be found again after so much distance [m], within
/// this distance [m] and turn [rad].
const BEYOND_DOUBT: f64 = 1e-6;
const CONFIRMED: f64 = 1.0;
const SAME: (f64, f64) = (0.5, 0.2);
/// What was seen longer ago is forgotten: the odometry drifts [m].
const KEPT: f64 = 12.0;

/// A search that goes on while the vehicle drives.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    relocalizer: Arc<Relocalizer>,
    view: LocalView,
    /// Distance driven and number of landmarks at the last try.
    tried: Option<(f64, usize)>,
    /// Tries in vain.
    vain: u32,
    /// Where the view lay at the first of the last tries that agree, and the distance driven then.
    candidate: Option<(Se2, f64)>,
}

impl Search {
    pub fn new(relocalizer: Arc<Relocalizer>) -> Self {
        Self { relocalizer, view: LocalView::default(), tried: None, vain: 0, candidate: None }
    }

    /// The walls of the map, if it has a grid.
    pub fn walls(&self) -> Option<Arc<Walls>> {
        self.relocalizer.walls()
    }

    /// The vehicle has moved; what was collected is kept only while it is lost.
    pub fn advance(&mut self, motion: &Se2, lost: bool) {
        if lost {
            self.view.advance(motion);
            self.view.forget_beyond(KEPT);
        } else if self.tried.is_some() || !self.view.is_empty() {
            *self = Self::new(self.relocalizer.clone());
        }
    }

    /// Keeps beams of a scan.
    pub fn look(&mut self, scan: &LaserScan, laser: &Se2, twist: Vector3<f64>) {
        self.view.look(scan, laser, twist);
    }

    /// Keeps observations, and tries where there is something new; the place, if it is certain.
    pub fn see(&mut self, observations: &[(Observation, Se2)]) -> Option<Located> {
        self.view.see(observations);
        let (distance, count) = (self.view.distance(), self.view.landmarks().len());
        let news = self.tried.is_none_or(|(d, n)| distance - d >= self.interval() || count >= n + MORE.max(n / 2));
        let poor = count < LEAST && self.view.looks().is_empty();
        if poor || !news {
            return None;
        }
        self.tried = Some((distance, count));
        self.vain += 1;
        let found = self.relocalizer.certain(&self.view);
        found.filter(|found| self.is_confirmed(found))
    }

    /// Whether a place is beyond doubt, or was found again some way on: the next metre tells rooms apart that are alike. Where
    /// there are no walls, landmarks alone must do.
    fn is_confirmed(&mut self, found: &Located) -> bool {
        let (place, distance) = (found.pose * self.view.pose().inverse(), self.view.distance());
        let same = |(before, _): &(Se2, f64)| {
            let d = before.between(&place);
            d.translation.norm() < SAME.0 && d.theta().abs() < SAME.1
        };
        let (_, since) = *self.candidate.insert(self.candidate.filter(same).unwrap_or((place, distance)));
        self.walls().is_none() || 1.0 - found.probability < BEYOND_DOUBT || distance - since >= CONFIRMED
    }

    fn interval(&self) -> f64 {
        (APART * (1.0 + LONGER.0 * f64::from(self.vain))).min(LONGER.1)
    }
}
