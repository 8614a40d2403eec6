//! The robot that explores: told what it finds, it says by which exit to leave.
//!
//! [`Explorer::next_exit`] gives one exit at a time and plans anew when its plan is used up or the building turned out
//! different: an exit led elsewhere, or there was no getting through. The strategy survey goes on when all cameras are
//! found: it drives the walks, each found by `search` with every place as a possible end, that lower
//! `length + lambda (sum of the cameras' position variances)`, lambda doubled from 2 upwards whenever no walk is worth
//! its length any more, so that distance is spent first where it reduces the uncertainty most, until
//!
//! - lambda is the one that was given, or
//! - the required sigma is reached, or
//! - the budget is used up.
//!
//! Assumes that a place is recognised when the robot comes back to it (a camera by its number, a junction by its looks),
//! and that the number of cameras is known, as they announce themselves on the network.

use super::belief::Belief;
use super::frontier::Frontier;
use super::known::{Known, Link, Place, Way, distances, shortest};
use super::noise::Noise;
use super::search::{Limits, Problem, cheapest, search};
use super::strategy::{Goal, Strategy};
use crate::error::Error;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The lambda that a survey begins to spend distance with [1/m].
const FIRST_LAMBDA: f64 = 2.0;
/// The lambda beyond which no sigma or budget leads a survey [1/m].
const LAST_LAMBDA: f64 = 1e6;

/// How to explore.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// What driving and looking add to the covariance.
    pub noise: Noise,
    /// The rule for the next drive.
    pub strategy: Strategy,
    /// What the drive shall achieve.
    pub goal: Goal,
    /// How long to think.
    pub limits: Limits,
}

impl Settings {
    /// Refuses settings without meaning.
    pub fn validate(&self) -> Result<(), Error> {
        self.noise.validate()?;
        self.goal.validate(self.strategy)?;
        let (expansions, passes) = (self.limits.expansions, self.limits.passes);
        Error::unless(expansions > 0, "expansions", expansions as f64, "must be at least 1")?;
        Error::unless(passes > 0, "passes", passes as f64, "must be at least 1")
    }
}

/// What happens to the robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Event {
    /// It came to a place.
    Arrived {
        /// The exit by which it left the place before.
        left: usize,
        /// What it found.
        place: Place,
        /// The exit of the new place through which it came in.
        enters: usize,
        /// Bends on the way [m]; left out: those it had before, none if it is new.
        #[serde(default)]
        via: Option<Vec<[f64; 2]>>,
    },
    /// There was no getting through this exit, and it is back where it was.
    Blocked {
        /// The exit.
        exit: usize,
    },
}

/// What one decision took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Decision {
    /// Walks that were expanded.
    pub expansions: usize,
    /// By what share of its cost a better walk could be cheaper.
    pub gap: f64,
}

/// A robot that explores.
#[derive(Clone, Debug)]
pub struct Explorer {
    settings: Settings,
    announced: usize,
    known: Known,
    belief: Belief,
    here: usize,
    heading: f64,
    driven: f64,
    lambda: f64,
    plan: VecDeque<usize>,
    errand: Option<usize>,
    decisions: Vec<Decision>,
}

impl Explorer {
    /// At the place that defines the map; `announced` cameras are to be found.
    pub fn new(settings: Settings, announced: usize, start: &Place, heading: f64) -> Result<Self, Error> {
        settings.validate()?;
        check(start)?;
        let (mut known, mut belief) = (Known::new(settings.noise), Belief::new(settings.noise));
        let camera = start.camera.then(|| belief.meet(start.position.into()));
        let here = known.add(start, camera);
        let lambda = if let Goal::Lambda(lambda) = settings.goal { lambda.min(FIRST_LAMBDA) } else { FIRST_LAMBDA };
        let (plan, errand, decisions, driven) = (VecDeque::new(), None, vec![], 0.0);
        Ok(Self { settings, announced, known, belief, here, heading, driven, lambda, plan, errand, decisions })
    }

    /// The exit by which to leave; None when there is nothing left to do.
    pub fn next_exit(&mut self) -> Option<usize> {
        if self.has_found_all() && self.is_as_accurate_as_asked() {
            return None;
        }
        if self.plan.is_empty() {
            self.plan = self.decide().into();
        }
        self.plan.pop_front()
    }

    /// Takes note of what happened on the way through the exit that [`Self::next_exit`] gave, or another.
    pub fn observe(&mut self, event: &Event) -> Result<(), Error> {
        match event {
            Event::Blocked { exit } => {
                self.check_exit(*exit)?;
                self.known.block(self.here, *exit);
                self.plan.clear();
                Ok(())
            }
            Event::Arrived { left, place, enters, via } => {
                self.check_exit(*left)?;
                check(place)?;
                let via: Option<Vec<_>> = via.as_ref().map(|via| via.iter().map(|&p| p.into()).collect());
                self.arrive(*left, place, *enters, via.as_deref())
            }
        }
    }

    /// The covariance of robot and cameras as of now.
    #[must_use]
    pub fn belief(&self) -> &Belief {
        &self.belief
    }

    /// Distance driven so far [m].
    #[must_use]
    pub fn driven(&self) -> f64 {
        self.driven
    }

    /// The searches so far.
    #[must_use]
    pub fn decisions(&self) -> &[Decision] {
        &self.decisions
    }

    /// Whether every camera that announced itself was found.
    #[must_use]
    pub fn has_found_all(&self) -> bool {
        self.belief.cameras().len() >= self.announced
    }

    fn arrive(&mut self, left: usize, place: &Place, enters: usize, via: Option<&[Vector2<f64>]>) -> Result<(), Error> {
        if enters >= place.exits.len() {
            let (key, count) = (place.key, place.exits.len());
            return Err(Error::Graph(format!("entered place {key} through exit {enters} of {count}")));
        }
        let found = self.known.find(place.key);
        let to = found.unwrap_or_else(|| self.known.add(place, None));
        if self.known.places[to].exits.len() != place.exits.len() {
            return Err(Error::Graph(format!("place {} had another number of exits before", place.key)));
        }
        let link = self.passed(left, to, enters, via)?;
        let turn = self.settings.noise.turning(self.known.places[self.here].at, link.passage.depart - self.heading);
        self.belief.drive(&(turn + link.passage.noise));
        self.driven += link.passage.length;
        (self.here, self.heading) = (to, link.passage.arrive);
        if place.camera {
            self.look(found.is_none());
        }
        Ok(())
    }

    /// The edge that was just driven, which becomes known if it was not, was thought to lead elsewhere or to be of another
    /// length.
    fn passed(&mut self, left: usize, to: usize, enters: usize, via: Option<&[Vector2<f64>]>) -> Result<Link, Error> {
        if let Way::Leads(link) = &self.known.places[self.here].exits[left].way
            && (link.to, link.enters) == (to, enters)
            && via.is_none_or(|via| self.known.is_as_long(link, self.here, via))
        {
            return Ok(link.clone());
        }
        let via = via.unwrap_or_default();
        self.plan.clear();
        self.known.forget(self.here, left);
        self.known.forget(to, enters);
        self.known.join((self.here, left), (to, enters), via)
    }

    /// A camera sees the robot.
    fn look(&mut self, is_new: bool) {
        let place = &mut self.known.places[self.here];
        match place.camera {
            Some(camera) => self.belief.meet_again(camera),
            None => place.camera = Some(self.belief.meet(place.at)),
        }
        if is_new {
            self.errand = self.errand();
        }
    }

    /// Where a rule sends the robot after a new camera.
    fn errand(&self) -> Option<usize> {
        match self.settings.strategy {
            Strategy::ReturnToOrigin => Some(0),
            Strategy::ReturnToNearest => {
                let apart = self.apart();
                let cameras = (0..apart.len()).filter(|&p| self.known.places[p].camera.is_some() && apart[p] > 0.0);
                cameras.filter(|&p| apart[p].is_finite()).min_by(|&a, &b| apart[a].total_cmp(&apart[b]))
            }
            _ => None,
        }
    }

    /// The next exits to take.
    fn decide(&mut self) -> Vec<usize> {
        if self.errand == Some(self.here) {
            self.errand = None;
        }
        if self.has_found_all() {
            return self.refine();
        }
        if let Some(home) = self.errand.take()
            && let Some(path) = self.path(home)
        {
            self.errand = Some(home);
            return path;
        }
        let apart = self.apart();
        let open = (0..apart.len()).filter(|&p| apart[p].is_finite() && self.known.untaken(p).next().is_some());
        let to = match self.settings.strategy {
            Strategy::Cheap | Strategy::Search | Strategy::Survey => {
                return self.weigh().unwrap_or_else(|| self.refine());
            }
            Strategy::DepthFirst => open.max(),
            _ => open.min_by(|&a, &b| apart[a].total_cmp(&apart[b])),
        };
        let onward = |to: usize| Some([self.path(to)?, self.known.untaken(to).take(1).collect()].concat());
        to.and_then(onward).unwrap_or_default()
    }

    /// Distances of all places from here; infinite where no known way leads.
    fn apart(&self) -> Vec<f64> {
        let mut start = vec![f64::INFINITY; self.known.places.len()];
        start[self.here] = 0.0;
        distances(&self.known.links(false), &start)
    }

    fn path(&self, to: usize) -> Option<Vec<usize>> {
        let path = shortest(&self.known.links(false), self.here, to)?;
        Some(path.into_iter().map(|link| link.exit).collect())
    }

    /// The walk to new ground with the least cost; None where no new ground can be reached.
    fn weigh(&mut self) -> Option<Vec<usize>> {
        let links = self.known.links(true);
        let mut frontier = Frontier::new(&self.known, &links);
        let lambda = match (self.settings.strategy, self.settings.goal) {
            (Strategy::Cheap | Strategy::Search, Goal::Lambda(lambda)) => lambda,
            _ => {
                frontier = frontier.with_tours(&self.known, &links);
                0.0
            }
        };
        let problem = self.problem(&links, &frontier.costs, lambda, true);
        let is_search = self.settings.strategy == Strategy::Search;
        let mut branches = problem.branches();
        let limits = &self.settings.limits;
        let walk = if is_search { search(&problem, &mut branches, limits) } else { cheapest(&problem, &mut branches) };
        let walk = walk?;
        self.decisions.push(Decision { expansions: walk.expansions, gap: walk.gap });
        let onward = frontier.choice(&self.known, walk.end, walk.heading);
        Some(walk.exits.into_iter().chain(onward).collect())
    }

    /// The next walk that is worth its length, with the strategy that goes on when there is nothing left to find.
    fn refine(&mut self) -> Vec<usize> {
        if self.settings.strategy != Strategy::Survey || self.is_as_accurate_as_asked() {
            return vec![];
        }
        let (exits, lambda, decisions) = self.worthwhile();
        self.lambda = lambda;
        self.decisions.extend(decisions);
        exits
    }

    /// The best walk for the least lambda, doubled, that makes one worth its length; that lambda, and the searches.
    fn worthwhile(&self) -> (Vec<usize>, f64, Vec<Decision>) {
        let links = self.known.links(true);
        let ends = vec![0.0; links.len()];
        let last = if let Goal::Lambda(lambda) = self.settings.goal { lambda } else { LAST_LAMBDA };
        let (mut lambda, mut decisions) = (self.lambda, vec![]);
        let mut branches = self.problem(&links, &ends, lambda, false).branches();
        loop {
            let problem = self.problem(&links, &ends, lambda, false);
            let walk = search(&problem, &mut branches, &self.settings.limits);
            let Some(walk) = walk else { return (vec![], lambda, decisions) };
            decisions.push(Decision { expansions: walk.expansions, gap: walk.gap });
            if !walk.exits.is_empty() || lambda >= last {
                return (walk.exits, lambda, decisions);
            }
            lambda = (2.0 * lambda).min(last);
        }
    }

    fn is_as_accurate_as_asked(&self) -> bool {
        matches!(self.settings.goal, Goal::Sigma(sigma) if self.belief.sigma() <= sigma)
    }

    fn problem<'a>(&'a self, links: &'a [Vec<Link>], ends: &'a [f64], lambda: f64, robot: bool) -> Problem<'a> {
        let reach = match self.settings.goal {
            Goal::Budget(budget) if !robot => (budget - self.driven).max(0.0),
            _ => f64::INFINITY,
        };
        let (belief, places, here, heading) = (&self.belief, &self.known.places[..], self.here, self.heading);
        Problem { belief, places, links, here, heading, ends, lambda, robot, reach }
    }

    fn check_exit(&self, exit: usize) -> Result<(), Error> {
        let place = &self.known.places[self.here];
        if exit < place.exits.len() {
            return Ok(());
        }
        Err(Error::Graph(format!("place {} has {} exits, none numbered {exit}", place.key, place.exits.len())))
    }
}

fn check(place: &Place) -> Result<(), Error> {
    if place.position.iter().chain(&place.exits).all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(Error::Graph(format!("place {}: position and exits must be finite", place.key)))
}
