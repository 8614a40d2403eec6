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
        "The run was interrupted: the result holds what had been read until then.", "Run it again to the end.";
    MapTorn "map-torn" Error Some("torn"),
        "Parts of the map may be misplaced against each other.",
        "Record odometry, drive slower, or drive the gap again.";
    ClosureViolated "closure-violated" Error Some("strained"),
        "The map cannot meet all of its loop closures: walls may be doubled there.",
        "Look at the place; drive it again.";
    NeverFound "never-found" Error Some("not-found"),
        "The vehicle was never located in the map.", "Give --start, or check that recording and map belong together.";
    ParameterOpen "parameter-open" Error Some("open"),
        "The drive does not determine all parameters.", "Drive what the text names, then calibrate again.";
    ModelMisfit "model-misfit" Warning Some("misfit"),
        "The residuals contradict the model: the intervals may be too narrow.",
        "Check wheels, slip and delay; do not rely on the intervals.";
    OdometrySlipped "odometry-slipped" Error Some("slipped"),
        "Cameras that follow each other all seem moved: the odometry slipped or jumped before.",
        "Leave that part of the drive out, or drive it again.";
    NotConverged "not-converged" Error Some("not-converged"),
        "The estimate did not converge.", "Do not rely on it; check the input that the text names.";
    MapMismatch "map-mismatch" Warning Some("mismatch"),
        "No landmark of the map was found again: map and drives seem to be of different places or frames.",
        "Check that the drives were localized in this map.";
    GoalMissed "goal-missed" Error Some("goal-missed"),
        "The plan does not reach what was asked for.", "Allow more, or ask for less, as the text says.";
    ToleranceMissed "tolerance-missed" Warning Some("go-on"),
        "The wanted accuracy is not reached yet.", "Drive on, as the text says.";
    // What the recording says.
    RecordingCut "recording-cut" Warning None,
        "The recording ends early: the rest could not be read.", "Copy or close the recording again.";
    RecordsMalformed "records-malformed" Warning None,
        "Records could not be read and were left out.", "Check what wrote the recording.";
    RecordsSkipped "records-skipped" Info None,
        "Records that groma does not use were passed over.", "";
    ReadingsInvalid "readings-invalid" Info None,
        "Range readings that are no range were taken as no return or as invalid.", "";
    BeamCount "beam-count" Info None,
        "angle_max does not fit the number of beams; beams are counted from angle_min.", "";
    Assumption "assumption" Info None,
        "The format leaves this open; this is how it was taken.", "";
    StreamChosen "stream-chosen" Info None,
        "One of several streams was taken.", "Name another by its option.";
    MountFound "mount-found" Info None,
        "Where the scanner sits, by the transforms of the recording.", "";
    MountUnknown "mount-unknown" Warning None,
        "The recording does not say where the scanner sits: it was taken to be at the origin of the vehicle.",
        "Record /tf_static, or give --vehicle.";
    ScannerTilted "scanner-tilted" Warning None,
        "The scan plane is not horizontal: ranges are those of the tilted plane.", "Level the scanner.";
    OdometryMissing "odometry-missing" Info None,
        "There is no odometry: motion comes from the scans alone.", "Record odometry or wheels where you can.";
    OdometryJump "odometry-jump" Warning None,
        "The odometry jumps farther than a robot drives.", "Check the odometry; drive that part again.";
    OdometryLate "odometry-late" Warning None,
        "Odometry or wheels come later than the scans they cover: poses were extrapolated, then corrected.",
        "Check the clocks; set a larger lateness in the settings.";
    StampsDisordered "stamps-disordered" Info None,
        "Messages do not come in the order of their stamps; they were put into order.", "";
    StampsLate "stamps-late" Warning None,
        "Messages came too late to be used and were left out.", "Set a larger lateness in the settings.";
    StampsInvalid "stamps-invalid" Warning None,
        "Messages were left out because of their stamps.", "Check the clocks of the sensors.";
    ClocksDiffer "clocks-differ" Warning None,
        "The times of two streams hardly overlap.", "Set the clocks of the sensors, and record them together.";
    ScansUnusable "scans-unusable" Warning None,
        "Scans could not be used and were left out.", "Check the scanner and its limits of range.";
    ScansWithoutPose "scans-without-pose" Warning None,
        "Scans were taken where no pose is known and were left out.",
        "Check that the stamps of scans and poses are of one clock.";
    ValuesInvalid "values-invalid" Warning None,
        "Messages with numbers that are not finite or out of range were left out.", "Check what wrote them.";
    JointsChosen "joints-chosen" Info None,
        "Which joints were taken for the wheels.", "Name others with --joints.";
    WheelsUnrolled "wheels-unrolled" Info None,
        "A wheel angle or counter wraps around: it was unrolled.", "";
    WheelsGap "wheels-gap" Warning None,
        "Readings of the wheels are missing.", "Record the wheels without gaps.";
    WheelsLeap "wheels-leap" Warning None,
        "A wheel counter leaps: it was reset or readings are wrong.", "Check the encoder.";
    WheelsFromOdometry "wheels-from-odometry" Info None,
        "Wheels were made from odometry: radii are factors on its wheels.", "";
    WheelsSwapped "wheels-swapped" Warning None,
        "Left and right wheel are swapped: the vehicle's front is where its rear was taken to be.",
        "Swap the joints with --joints, or in the driver, and calibrate again.";
    WheelReversed "wheel-reversed" Warning None,
        "A wheel counts backward when the vehicle drives forward.", "Turn the sign of its counter in the driver.";
    // What an estimate says.
    LoopNone "loop-none" Warning None,
        "No loop was closed: only registration from scan to scan holds the map together.",
        "Drive past places that were seen before.";
    WeakStretch "weak-stretch" Warning None,
        "Along this stretch the pose is weakly determined.", "Drive it again, or add landmarks there.";
    OdometryOverruled "odometry-overruled" Warning None,
        "Odometry contradicted the scans and was left out there.", "Calibrate the vehicle; look for slip.";
    ScannerOffset "scanner-offset" Warning None,
        "Scans and odometry agree best with the scanner at another place than the recording gives.",
        "Calibrate the vehicle, or correct /tf_static.";
    PoseLost "pose-lost" Warning None,
        "The pose was not known during this time.", "Update the map there, or add landmarks.";
    LandmarksDisagree "landmarks-disagree" Warning None,
        "What the scans show disagrees with the map here.", "Map the place again.";
    LandmarksUnseen "landmarks-unseen" Info None,
        "Landmarks of the map were not seen; they stay in it.", "";
    MotionsLeftOut "motions-left-out" Info None,
        "Motions could not be used for the calibration.", "";
    ParametersAssumed "parameters-assumed" Info None,
        "What the calibration assumed or chose.", "";
    SigmaTooSmall "sigma-too-small" Warning None,
        "Residuals are larger than the stated errors: standard deviations are too small.",
        "Check what the text names.";
    CameraUnseen "camera-unseen" Warning None,
        "A camera was never seen well enough to be placed.", "Drive the target past it.";
    CameraMoved "camera-moved" Warning None,
        "A camera moved during the survey.", "Fasten it, and tell what used its old pose.";
    CameraMisfit "camera-misfit" Warning None,
        "The corners of one camera fit far worse than those of the others.", "Calibrate it again.";
    CameraWeak "camera-weak" Info None,
        "The position of a camera is known far worse along one direction.", "";
    MessagesLost "messages-lost" Warning None,
        "Messages of a sender never arrived.", "Check the network between sender and survey.";
    PlacesUnreachable "places-unreachable" Warning None,
        "Places of the building cannot be driven to and were left out.", "Check the map, or draw the graph by hand.";
    ReferenceDrifts "reference-drifts" Warning None,
        "The poses that judge come from odometry, which drifts.", "Give better poses with --poses.";
    ViewsLeftOut "views-left-out" Info None,
        "Images or views could not be used.", "";
    LimitReached "limit-reached" Warning None,
        "A limit was reached: the result is what was found until then.", "";
}
