//! The landmarks whose error the filter remembers: some of the map, and all found during the drive.
//!
//! Each has a slot in the [`Joint`]. A landmark of the map enters when it is first seen and leaves when room is needed,
//! the one not seen for longest first; what it had in common with the pose is then forgotten. One found during the drive
//! begins with the pose's error, and updates the pose once it is proven.

use crate::joint::Joint;
use crate::options::DynamicOptions;
use groma_models::LandmarkKind;

const NONE: u32 = u32::MAX;

/// A landmark found during the drive.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Found {
    /// Its number, never given again.
    pub id: usize,
    pub kind: LandmarkKind,
    /// Direction into which the corner opens, in the map [rad].
    pub orientation: Option<f64>,
    pub descriptor: Option<u128>,
    /// Scans that saw it, and could have.
    pub hits: u32,
    pub visible: u32,
    /// Scans in a row that could have seen it and did not.
    pub misses: u32,
    /// Whether it updates the pose.
    pub proven: bool,
    /// Distance driven [m] and time [s] when it was last seen.
    pub distance: f64,
    pub stamp: f64,
}

/// What is in a slot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Slot {
    /// A landmark of the map, and the scan that saw it last.
    Map { landmark: usize, scan: u64 },
    /// A landmark found during the drive.
    Found(Found),
}

/// What became of the landmarks found during the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Changes {
    pub proven: usize,
    pub forgotten: usize,
}

/// The slots, in the order of the joint state.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    slots: Vec<Slot>,
    slot_of: Vec<u32>,
    next_id: usize,
}

impl Memory {
    /// Nothing remembered of a map of so many landmarks.
    pub fn new(map: usize) -> Self {
        Self { slots: Vec::new(), slot_of: vec![NONE; map], next_id: map }
    }

    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The landmark found during the drive that is in a slot.
    pub fn found(&self, slot: usize) -> Option<&Found> {
        match self.slots.get(slot) {
            Some(Slot::Found(found)) => Some(found),
            _ => None,
        }
    }

    /// The same, to be changed.
    pub fn found_mut(&mut self, slot: usize) -> Option<&mut Found> {
        match self.slots.get_mut(slot) {
            Some(Slot::Found(found)) => Some(found),
            _ => None,
        }
    }

    /// All landmarks found during the drive, with their slots.
    pub fn all_found(&self) -> impl Iterator<Item = (usize, &Found)> {
        self.slots.iter().enumerate().filter_map(|(slot, s)| match s {
            Slot::Found(found) => Some((slot, found)),
            Slot::Map { .. } => None,
        })
    }

    /// The slot of a landmark of the map.
    pub fn slot_of(&self, landmark: usize) -> Option<usize> {
        self.slot_of.get(landmark).filter(|s| **s != NONE).map(|s| *s as usize)
    }

    /// Writes down the slot that a landmark of the map has got.
    pub fn remember(&mut self, slot: usize, landmark: usize, scan: u64) {
        self.slot_of[landmark] = slot as u32;
        self.slots.push(Slot::Map { landmark, scan });
    }

    /// Writes down that a landmark of the map was seen.
    pub fn touch(&mut self, slot: usize, now: u64) {
        if let Some(Slot::Map { scan, .. }) = self.slots.get_mut(slot) {
            *scan = now;
        }
    }

    /// Writes down a landmark found during the drive, which has got the last slot; its number.
    pub fn begin(&mut self, found: Found) -> usize {
        let id = self.next_id;
        self.next_id += 1;
        self.slots.push(Slot::Found(Found { id, ..found }));
        id
    }

    /// Forgets landmarks of the map beyond `most`, those first that were not seen for longest.
    pub fn limit(&mut self, joint: &mut Joint, most: usize) {
        let remembered = self.slots.iter().filter(|s| matches!(s, Slot::Map { .. })).count();
        for _ in most..remembered {
            let scans = self.slots.iter().enumerate().filter_map(|(slot, s)| match s {
                Slot::Map { scan, .. } => Some((*scan, slot)),
                Slot::Found(_) => None,
            });
            let Some((_, oldest)) = scans.min() else { return };
            self.remove(joint, oldest);
        }
    }

    /// Forgets a slot; the last one takes its place.
    pub fn remove(&mut self, joint: &mut Joint, slot: usize) {
        joint.remove(slot);
        if let Slot::Map { landmark, .. } = self.slots.swap_remove(slot) {
            self.slot_of[landmark] = NONE;
        }
        if let Some(Slot::Map { landmark, .. }) = self.slots.get(slot) {
            self.slot_of[*landmark] = slot as u32;
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self, joint: &mut Joint) {
        (0..self.slots.len()).rev().for_each(|slot| self.remove(joint, slot));
    }

    /// Proves and forgets landmarks found during the drive.
    pub fn review(&mut self, joint: &mut Joint, distance: f64, stamp: f64, options: &DynamicOptions) -> Changes {
        let mut changes = Changes::default();
        for slot in (0..self.slots.len()).rev() {
            let Slot::Found(found) = &mut self.slots[slot] else { continue };
            if found.is_spent(distance, stamp, options) {
                self.remove(joint, slot);
                changes.forgotten += 1;
            } else if !found.proven && found.hits >= options.hits {
                found.proven = true;
                changes.proven += 1;
            }
        }
        changes
    }
}

impl Found {
    fn is_spent(&self, distance: f64, stamp: f64, options: &DynamicOptions) -> bool {
        let failed = !self.proven && self.hits < options.hits && self.visible >= options.trial;
        let rare =
            self.visible >= 2 * options.trial && f64::from(self.hits) < options.share_min * f64::from(self.visible);
        let old = distance - self.distance > options.way_max || stamp - self.stamp > options.time_max;
        failed || rare || old || self.misses >= options.misses
    }
}
