//! All codes of findings: name, severity, the verdict that they force, what they mean and what to do.
//!
//! The order decides between verdicts: what stands first wins. A code is never renamed: others rely on it.

use super::Severity::{self, Error, Info, Warning};

macro_rules! catalogue {
    ($($code:ident $name:literal $severity:ident $verdict:expr, $meaning:literal, $remedy:literal;)*) => {
        /// What a finding is.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Code {
            $(#[doc = $meaning] $code,)*
        }

        impl Code {
            /// All codes, those that decide a verdict in the order of their weight.
            pub const ALL: &'static [Self] = &[$(Self::$code,)*];

            /// The stable name in files.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$code => $name,)* }
            }

            /// How much it matters.
            #[must_use]
            pub fn severity(self) -> Severity {
                match self { $(Self::$code => $severity,)* }
            }

            /// The verdict that it forces on a run.
            #[must_use]
            pub fn verdict(self) -> Option<&'static str> {
                match self { $(Self::$code => $verdict,)* }
            }

            /// What it means for the result.
            #[must_use]
            pub fn meaning(self) -> &'static str {
                match self { $(Self::$code => $meaning,)* }
            }

            /// What to do; empty where nothing is to be done.
            #[must_use]
            pub fn remedy(self) -> &'static str {
                match self { $(Self::$code => $remedy,)* }
            }

            /// The code of a name.
            #[must_use]
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|code| code.name() == name)
            }
        }
    };
}

catalogue! {
    // What decides a verdict, the weightiest first.
    NoEstimate "no-estimate" Error Some("no-estimate"),
        "The data did not allow an estimate.", "Read the other findings: they say what is missing.";
    Interrupted "interrupted" Warning Some("interrupted"),
        "The run was interrupted: the result is from what had been read until then.", "Run it again to the end.";
    MapTorn "map-torn" Error Some("torn"),
        "Parts of the map may be misplaced relative to each other.",
        "Record odometry, drive slower, or drive the gap again.";
    ClosureViolated "closure-violated" Error Some("strained"),
        "The map does not agree with all of its loop closures: walls may be doubled there.",
        "Look at the place; drive it again.";
    NeverFound "never-found" Error Some("not-found"),
        "The vehicle was never localized in the map.", "Give --start, or check that recording and map belong together.";
    ParameterOpen "parameter-open" Error Some("open"),
        "The drive does not determine all parameters.", "Drive what the text names, then calibrate again.";
    ModelMisfit "model-misfit" Warning Some("misfit"),
        "The residuals contradict the model: the intervals may be too narrow.",
        "Check wheels, slip and delay; do not rely on the intervals.";
    OdometrySlipped "odometry-slipped" Error Some("slipped"),
        "Several consecutive cameras seem to have moved: the odometry slipped or jumped before.",
        "Leave that part of the drive out, or drive it again.";
    NotConverged "not-converged" Error Some("not-converged"),
        "The estimate did not converge.", "Do not rely on it; check the input that the text names.";
    MapMismatch "map-mismatch" Warning Some("mismatch"),
        "No landmark of the map was observed: map and drives seem to be of different places or frames.",
        "Check that the drives were localized in this map.";
    GoalMissed "goal-missed" Error Some("goal-missed"),
        "The plan does not reach the goal.", "Allow a longer drive, or relax the goal, as the text says.";
    ToleranceMissed "tolerance-missed" Warning Some("go-on"),
        "The required accuracy is not reached yet.", "Drive more, as the text says.";
    // What the recording says.
    RecordingCut "recording-cut" Warning None,
        "The recording ends early: the rest could not be read.", "Copy or close the recording again.";
    RecordsMalformed "records-malformed" Warning None,
        "Records could not be read and were skipped.", "Check what wrote the recording.";
    RecordsSkipped "records-skipped" Info None,
        "Records that groma does not use were skipped.", "";
    ReadingsInvalid "readings-invalid" Info None,
        "Range readings that are not a range count as no return or as invalid.", "";
    BeamCount "beam-count" Info None,
        "angle_max does not fit the number of beams; beams are counted from angle_min.", "";
    Assumption "assumption" Info None,
        "The format does not specify this; an assumption was made.", "";
    StreamChosen "stream-chosen" Info None,
        "One of several streams was used.", "Choose another by its option.";
    MountFound "mount-found" Info None,
        "Pose of the scanner, from the transforms of the recording.", "";
    MountUnknown "mount-unknown" Warning None,
        "The recording lacks the pose of the scanner: it is assumed to be at the origin of the vehicle.",
        "Record /tf_static, or give --vehicle.";
    ScannerTilted "scanner-tilted" Warning None,
        "The scan plane is not horizontal: ranges are those of the tilted plane.", "Level the scanner.";
    OdometryMissing "odometry-missing" Info None,
        "There is no odometry: motion comes from the scans alone.", "Record odometry or wheels where you can.";
    OdometryJump "odometry-jump" Warning None,
        "The odometry jumps by more than a robot can drive.", "Check the odometry; drive that part again.";
    OdometryLate "odometry-late" Warning None,
        "Odometry or wheels come later than the scans they cover: poses were extrapolated, then corrected.",
        "Check the clocks; set a larger lateness in the settings.";
    StampsDisordered "stamps-disordered" Info None,
        "Messages are not in the order of their stamps; they were sorted.", "";
    StampsLate "stamps-late" Warning None,
        "Messages came too late and were skipped.", "Set a larger lateness in the settings.";
    StampsInvalid "stamps-invalid" Warning None,
        "Messages were skipped because of their stamps.", "Check the clocks of the sensors.";
    ClocksDiffer "clocks-differ" Warning None,
        "The times of two streams hardly overlap.", "Set the clocks of the sensors, and record them together.";
    ScansUnusable "scans-unusable" Warning None,
        "Scans could not be used and were skipped.", "Check the scanner and its limits of range.";
    ScansWithoutPose "scans-without-pose" Warning None,
        "Scans without a known pose were skipped.",
        "Check that the stamps of scans and poses are of one clock.";
    ValuesInvalid "values-invalid" Warning None,
        "Messages with numbers that are not finite or out of range were skipped.", "Check what wrote them.";
    JointsChosen "joints-chosen" Info None,
        "The joints used as wheels.", "Choose others with --joints.";
    WheelsUnrolled "wheels-unrolled" Info None,
        "A wheel angle or counter wraps around: it was unwrapped.", "";
    WheelsGap "wheels-gap" Warning None,
        "Readings of the wheels are missing.", "Record the wheels without gaps.";
    WheelsLeap "wheels-leap" Warning None,
        "A wheel counter leaps: it was reset or readings are wrong.", "Check the encoder.";
    WheelsFromOdometry "wheels-from-odometry" Info None,
        "Wheel motions were computed from odometry: radii are factors on those of its wheels.", "";
    WheelsSwapped "wheels-swapped" Warning None,
        "Left and right wheel are swapped: the front of the vehicle is where its rear was assumed.",
        "Swap the joints with --joints, or in the driver, and calibrate again.";
    WheelReversed "wheel-reversed" Warning None,
        "A wheel counts backward when the vehicle drives forward.", "Invert the sign of its counter in the driver.";
    // What an estimate says.
    LoopNone "loop-none" Warning None,
        "No loop was closed: the map depends on scan-to-scan registration alone.",
        "Drive past places that were seen before.";
    WeakStretch "weak-stretch" Warning None,
        "Along this stretch the pose is weakly determined.", "Drive it again, or add landmarks there.";
    OdometryOverruled "odometry-overruled" Warning None,
        "Odometry contradicted the scans and was ignored there.", "Calibrate the vehicle; look for slip.";
    ScannerOffset "scanner-offset" Warning None,
        "Scans and odometry agree best with another pose of the scanner than that of the recording.",
        "Calibrate the vehicle, or correct /tf_static.";
    PoseLost "pose-lost" Warning None,
        "The pose was not known during this time.", "Update the map there, or add landmarks.";
    LandmarksDisagree "landmarks-disagree" Warning None,
        "The scans disagree with the map here.", "Map the place again.";
    LandmarksUnseen "landmarks-unseen" Info None,
        "Landmarks of the map were not observed; they remain in it.", "";
    MotionsLeftOut "motions-left-out" Info None,
        "Motions could not be used for the calibration.", "";
    ParametersAssumed "parameters-assumed" Info None,
        "Assumptions and choices of the calibration.", "";
    SigmaTooSmall "sigma-too-small" Warning None,
        "Residuals are larger than the stated errors: standard deviations are too small.",
        "Check what the text names.";
    CameraUnseen "camera-unseen" Warning None,
        "A camera never had a view good enough to be localized.", "Drive the target past it.";
    CameraMoved "camera-moved" Warning None,
        "A camera moved during the survey.", "Fasten it, and update whatever uses its old pose.";
    CameraMisfit "camera-misfit" Warning None,
        "The corners of one camera fit far worse than those of the others.", "Calibrate it again.";
    CameraWeak "camera-weak" Info None,
        "The position of a camera is much less accurate along one direction.", "";
    MessagesLost "messages-lost" Warning None,
        "Messages of a sender never arrived.", "Check the network between sender and survey.";
    PlacesUnreachable "places-unreachable" Warning None,
        "Places of the building cannot be reached and were skipped.", "Check the map, or draw the graph by hand.";
    ReferenceDrifts "reference-drifts" Warning None,
        "The reference poses come from odometry, which drifts.", "Give better poses with --poses.";
    ViewsLeftOut "views-left-out" Info None,
        "Images or views could not be used.", "";
    LimitReached "limit-reached" Warning None,
        "A limit was reached: the result is the best found until then.", "";
}
