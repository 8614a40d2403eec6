use super::*;
use crate::order::Order;
use crate::{Message, WheelRecord};
use groma_models::finding::Code;
use proptest::prelude::*;

const KINDS: [WheelKind; 2] = [WheelKind::Steered, WheelKind::Differential];

fn both(stamp: f64, a: f64, b: f64) -> WheelReading {
    WheelReading { stamp, positions: vec![(0, a), (1, b)] }
}

fn one(stamp: f64, joint: usize, position: f64) -> WheelReading {
    WheelReading { stamp, positions: vec![(joint, position)] }
}

/// A drive at 50 Hz: wheels that run up to 30 rad/s and back, a steering that swings.
fn drive(kind: WheelKind, count: usize) -> Vec<(f64, Vector2<f64>)> {
    let row = |k: usize| {
        let t = 0.02 * k as f64;
        let second = match kind {
            WheelKind::Steered => 0.8 * (0.9 * t).sin(),
            WheelKind::Differential => 25.0 * t - 10.0 * (2.0 * t).sin(),
        };
        (t, Vector2::new(30.0 * (1.0 - t.cos()), second))
    };
    (0..count).map(row).collect()
}

fn rows(kind: WheelKind, messages: &[WheelReading]) -> (Vec<WheelRow>, Vec<Code>) {
    let mut reader = WheelReader::new(kind);
    let rows = messages.iter().flat_map(|m| reader.push(m)).collect();
    (rows, reader.findings().iter().map(|f| f.code).collect())
}

fn whole(kind: WheelKind, drive: &[(f64, Vector2<f64>)]) -> Vec<WheelRow> {
    let messages: Vec<_> = drive.iter().map(|(t, v)| both(*t, v.x, v.y)).collect();
    rows(kind, &messages).0
}

fn broken(rows: &[WheelRow]) -> Vec<f64> {
    rows.iter().skip(1).filter(|r| r.step.is_none()).map(|r| r.stamp).collect()
}

#[test]
fn steps_are_the_counts_gained_and_the_mean_of_the_steering() {
    for kind in KINDS {
        let truth = drive(kind, 200);
        let rows = whole(kind, &truth);
        assert_eq!(rows.len(), truth.len());
        assert!(rows[0].step.is_none());
        for (row, pair) in rows[1..].iter().zip(truth.windows(2)) {
            let step = row.step.unwrap();
            assert_eq!((step.start, step.end), (pair[0].0, pair[1].0));
            assert!((step.input.x - (pair[1].1.x - pair[0].1.x)).abs() < 1e-12);
            let second = match kind {
                WheelKind::Steered => (pair[0].1.y + pair[1].1.y) / 2.0,
                WheelKind::Differential => pair[1].1.y - pair[0].1.y,
            };
            assert!((step.input.y - second).abs() < 1e-12);
        }
    }
}

#[test]
fn a_steering_angle_takes_the_short_way_round() {
    let messages = [both(0.0, 0.0, 3.1), both(0.1, 1.0, 3.1 + 0.2), both(0.2, 2.0, -3.0)];
    let (rows, _) = rows(WheelKind::Steered, &messages);
    assert!(rows.iter().all(|r| r.reading.y.abs() <= std::f64::consts::PI));
    let mean = rows[1].step.unwrap().input.y;
    assert!((wrap(mean - 3.2)).abs() < 1e-12, "{mean}");
}

#[test]
fn a_steering_of_its_own_rate_takes_the_short_way_round() {
    let messages = [one(0.0, 1, 3.1), one(0.1, 0, 1.0), one(0.2, 1, -3.1)];
    let (rows, _) = rows(WheelKind::Steered, &messages);
    assert!(wrap(rows[0].reading.y - std::f64::consts::PI).abs() < 1e-9, "{:?}", rows[0]);
}

#[test]
fn a_joint_of_its_own_rate_is_interpolated_when_it_has_come() {
    let mut reader = WheelReader::new(WheelKind::Differential);
    assert!(reader.push(&one(0.00, 1, 0.0)).is_empty());
    assert!(reader.push(&one(0.04, 0, 7.0)).is_empty(), "the second joint has not come that far");
    assert!(reader.push(&one(0.08, 0, 8.0)).is_empty());
    let rows = reader.push(&one(0.10, 1, 5.0));
    let read: Vec<_> = rows.iter().map(|r| (r.stamp, r.reading.x)).collect();
    assert_eq!(read, [(0.04, 7.0), (0.08, 8.0)]);
    assert!((rows[0].reading.y - 2.0).abs() < 1e-12 && (rows[1].reading.y - 4.0).abs() < 1e-12);
    assert_eq!(reader.push(&one(0.10, 0, 9.0)).len(), 1, "an equal stamp waits for nothing");
}

#[test]
fn missing_readings_break_the_log_and_a_slow_log_does_not() {
    let fast: Vec<f64> = (0..100).map(|k| 0.02 * f64::from(k) + if k >= 50 { 0.7 } else { 0.0 }).collect();
    let slow: Vec<f64> = (0..100).map(f64::from).collect();
    for (stamps, breaks, codes) in [(fast, vec![0.02 * 50.0 + 0.7], vec![Code::WheelsGap]), (slow, vec![], vec![])] {
        let messages: Vec<_> = stamps.iter().map(|t| both(*t, *t, 2.0 * t)).collect();
        let (rows, found) = rows(WheelKind::Differential, &messages);
        assert_eq!((broken(&rows), found), (breaks, codes));
    }
}

#[test]
fn a_silent_second_joint_gives_no_rows_across_its_gap() {
    let mut messages: Vec<_> = (0..200).map(|k| one(0.02 * f64::from(k), 0, f64::from(k))).collect();
    let heard = |k: &i32| !(50..150).contains(k);
    messages.extend((0..200).filter(heard).map(|k| one(0.02 * f64::from(k), 1, f64::from(k))));
    let (read, codes) = rows(WheelKind::Differential, &messages);
    assert!(read.iter().all(|r| r.stamp < 0.99 || r.stamp > 2.99), "nothing is made up within");
    assert_eq!((broken(&read).len(), codes), (1, vec![Code::WheelsGap]));
    let to_the_end: Vec<_> = messages.into_iter().filter(|m| m.positions[0].0 == 0 || m.stamp < 1.0).collect();
    assert_eq!(rows(WheelKind::Differential, &to_the_end).1, [Code::WheelsGap]);
}

#[test]
fn a_reset_counter_breaks_the_log_once_and_a_wrong_reading_twice() {
    let driven = |k: i32| 100.0 + 0.1 * f64::from(k);
    let at = |f: &dyn Fn(i32) -> f64| -> (Vec<f64>, Vec<Code>) {
        let messages: Vec<_> = (0..200).map(|k| both(0.02 * f64::from(k), f(k), driven(k))).collect();
        let (rows, codes) = rows(WheelKind::Differential, &messages);
        (broken(&rows), codes)
    };
    let reset = at(&|k| if k < 120 { driven(k) } else { 0.1 * f64::from(k - 120) });
    assert_eq!(reset, (vec![0.02 * 120.0], vec![Code::WheelsLeap]));
    let spike = at(&|k| if k == 120 { 900.0 } else { driven(k) });
    assert_eq!(spike, (vec![0.02 * 120.0, 0.02 * 121.0], vec![Code::WheelsLeap]));
}

#[test]
fn gathering_speed_after_creeping_is_no_leap() {
    let speed = |k: i32| if k < 500 { 0.1 } else { (0.1 + 0.2 * f64::from(k - 500)).min(40.0) };
    let mut sum = 100.5;
    let messages: Vec<_> = (0..1500)
        .map(|k| {
            sum += 0.02 * speed(k);
            both(0.02 * f64::from(k), sum, 0.1)
        })
        .collect();
    let (rows, codes) = rows(WheelKind::Steered, &messages);
    assert_eq!((broken(&rows), codes), (vec![], vec![]));
}

#[test]
fn jitter_of_the_stamps_is_no_leap() {
    let jitter = |k: usize| 0.0199 * (7.3 * k as f64).sin();
    for kind in KINDS {
        let mut messages: Vec<_> = drive(kind, 1000)
            .iter()
            .enumerate()
            .map(|(k, (t, v))| both(0.02 + t + jitter(k) / 2.0, 100.5 + v.x, v.y))
            .collect();
        messages.sort_by(|a, b| a.stamp.total_cmp(&b.stamp));
        messages[500].stamp = messages[499].stamp + 1e-9;
        messages[700].stamp = messages[699].stamp;
        let (rows, codes) = rows(kind, &messages);
        assert_eq!((rows.len(), broken(&rows), codes), (999, vec![], vec![Code::StampsInvalid]));
        let counted: f64 = rows.iter().filter_map(|r| r.step).map(|s| s.input.x).sum();
        let driven = rows[rows.len() - 1].reading.x - rows[0].reading.x;
        assert!((counted - driven).abs() < 1e-9, "nothing is lost with a repeated stamp");
    }
}

#[test]
fn what_is_no_reading_is_counted() {
    let mut messages: Vec<_> = (0..50).map(|k| both(0.02 * f64::from(k), 0.1 * f64::from(k), 0.0)).collect();
    messages[10].positions[0].1 = f64::NAN;
    messages[20].positions[1].1 = 1e300;
    messages[30].stamp = f64::INFINITY;
    messages[40].stamp = 0.5;
    messages.push(WheelReading { stamp: 2.0, positions: vec![(7, 1.0)] });
    let mut reader = WheelReader::new(WheelKind::Steered);
    let rows: Vec<_> = messages.iter().flat_map(|m| reader.push(m)).collect();
    assert!(rows.iter().all(|r| r.reading.iter().all(|v| v.is_finite()) && r.stamp.is_finite()));
    let counts: Vec<_> = reader.findings().iter().map(|f| (f.code, f.values[0].value)).collect();
    assert_eq!(counts, [(Code::ValuesInvalid, 4.0), (Code::StampsLate, 2.0)]);
}

#[test]
fn a_record_knows_its_breaks() {
    let messages = (0..100).map(|k| {
        let t = 0.02 * f64::from(k) + if k >= 50 { 3.0 } else { 0.0 };
        both(t, t, 0.0)
    });
    let (record, findings) = WheelRecord::ordered(WheelKind::Steered, messages, 0.0);
    assert_eq!((record.times().len(), record.breaks().len()), (100, 1));
    assert_eq!(record.breaks(), [(record.times()[49], record.times()[50])]);
    assert_eq!(findings[0].span, Some(record.breaks()[0]));
    assert_eq!(record.log().unwrap().span(), (record.times()[0], record.times()[99]));
}

/// Wheels of an arc that odometry describes turn as the arc says.
#[test]
fn wheels_made_from_odometry_turn_as_its_arcs_say() {
    use groma_geometry::Se2;
    let (forward, turn, axle) = (0.8, 0.3, 0.5);
    let mut wheels = VirtualWheels::new(axle);
    let pose = |t: f64| Se2::exp(nalgebra::Vector3::new(forward * t, 0.0, turn * t));
    for t in (0..300).map(|k| 0.1 * f64::from(k)) {
        let reading = wheels.push(&groma_models::Odometry { stamp: t, pose: pose(t) }).unwrap();
        let expected = [(forward - turn * axle / 2.0) * t, (forward + turn * axle / 2.0) * t];
        for ((_, turned), expected) in reading.positions.iter().zip(expected) {
            assert!((turned - expected).abs() < 1e-9);
        }
    }
    assert!(wheels.push(&groma_models::Odometry { stamp: 1.0, pose: pose(1.0) }).is_none());
}

/// The same drive in messages of one joint or two, interleaved in any way that keeps the order within each joint.
fn split(drive: &[(f64, Vector2<f64>)], apart: &[bool], delays: &[usize]) -> Vec<WheelReading> {
    let mut placed: Vec<(usize, WheelReading)> = Vec::new();
    let mut latest = 0;
    for (k, (t, v)) in drive.iter().enumerate() {
        if apart[k % apart.len()] {
            latest = latest.max(k + delays[k % delays.len()]);
            placed.push((2 * k, one(*t, 0, v.x)));
            placed.push((2 * latest + 1, one(*t, 1, v.y)));
        } else {
            latest = latest.max(k);
            placed.push((2 * k, one(*t, 0, v.x)));
            placed.push((2 * latest + 1, one(*t, 1, v.y)));
        }
    }
    placed.sort_by_key(|(at, _)| *at);
    placed.into_iter().map(|(_, m)| m).collect()
}

proptest! {
    #[test]
    fn any_splitting_of_the_joints_gives_the_same_rows(
        apart in prop::collection::vec(any::<bool>(), 1..30), delays in prop::collection::vec(0..20_usize, 1..30),
    ) {
        for kind in KINDS {
            let truth = drive(kind, 300);
            let (read, _) = rows(kind, &split(&truth, &apart, &delays));
            prop_assert_eq!(read, whole(kind, &truth));
        }
    }

    #[test]
    fn counters_that_wrap_give_the_same_steps(count in 10..400_usize) {
        use std::f64::consts::TAU;
        for kind in KINDS {
            let truth = drive(kind, count);
            let folds: [fn(f64) -> f64; 2] = [wrap, |x| x.rem_euclid(TAU)];
            for fold in folds {
                let second = |x: f64| if kind == WheelKind::Steered { x } else { fold(x) };
                let folded: Vec<_> =
                    truth.iter().map(|(t, v)| (*t, Vector2::new(fold(v.x), second(v.y)))).collect();
                for (a, b) in whole(kind, &folded).iter().zip(whole(kind, &truth)).skip(1) {
                    let difference = a.step.unwrap().input - b.step.unwrap().input;
                    prop_assert!(difference.norm() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn permutations_within_the_lateness_give_the_same_rows(shifts in prop::collection::vec(0.0..0.19_f64, 300)) {
        for kind in KINDS {
            let truth = drive(kind, 300);
            let mut arrivals: Vec<_> = truth.iter().zip(&shifts).map(|(row, shift)| (row.0 + shift, *row)).collect();
            arrivals.sort_by(|a, b| a.0.total_cmp(&b.0));
            let messages: Vec<_> = arrivals.iter().map(|(_, (t, v))| both(*t, v.x, v.y)).collect();
            let (record, findings) = WheelRecord::ordered(kind, messages.clone(), 0.2);
            prop_assert_eq!(record.times().to_vec(), truth.iter().map(|r| r.0).collect::<Vec<_>>());
            prop_assert!(findings.is_empty() && record.breaks().is_empty());
            // Without waiting, what is late is left out and counted, nothing is sorted wrongly.
            let (hasty, findings) = WheelRecord::ordered(kind, messages.clone(), 0.0);
            let late: f64 = findings.iter().filter(|f| f.code == Code::StampsLate).map(|f| f.values[0].value).sum();
            prop_assert_eq!(hasty.times().len() + late as usize, truth.len());
            prop_assert!(hasty.times().windows(2).all(|w| w[0] < w[1]));
            // A file asks for the lateness that it needs, and says so.
            let (whole, findings) = WheelRecord::read(kind, messages.clone());
            prop_assert_eq!(&whole, &record);
            let disordered = messages.windows(2).any(|w| w[0].stamp > w[1].stamp);
            prop_assert_eq!(findings.iter().any(|f| f.code == Code::StampsDisordered), disordered);
        }
    }
}

/// The reader fed by an order that waits gives what it gives without one where nothing is late.
#[test]
fn waiting_changes_nothing_where_nothing_is_late() {
    let truth = drive(WheelKind::Differential, 200);
    let (mut order, mut reader) = (Order::new(0.5), WheelReader::new(WheelKind::Differential));
    let mut read = Vec::new();
    let mut take = |messages: Vec<Message>| {
        for message in messages {
            if let Message::Wheels(reading) = message {
                read.extend(reader.push(&reading));
            }
        }
    };
    for (t, v) in &truth {
        take(order.push(Message::Wheels(both(*t, v.x, v.y))));
    }
    take(order.drain());
    assert_eq!(read, whole(WheelKind::Differential, &truth));
}
