//! A coast-down ω = e^(−t/τ) over rows of 20 ms, compared with closed forms.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::identify::fit::parameters::{DerivativeScalar, Dual};
use crate::model::Input;
use crate::recording::voltage::InputTiming;

const ROW_S: f64 = 0.02;
/// The rate halves in a row.
const TAU_S: f64 = 0.029;
const ROWS: usize = 12;

fn compared(shows: Channel, mean_before_s: Option<f64>) -> ComparedChannel<'static> {
    ComparedChannel {
        channel: shows,
        measured: &[],
        sample_interval_s: None,
        mean_before_s,
        filter_hz: None,
        instant: false,
        quantum: None,
        outliers: None,
        limited_rows: 0,
        magnitude: false,
    }
}

fn prepared<'a>(t_s: &'a [f64], channel: ComparedChannel<'a>) -> PreparedLog<'a> {
    PreparedLog {
        predictor: None,
        absolute_angle: false,
        t_s: t_s.into(),
        axis: Default::default(),
        input: (&[]).into(),
        voltage_course: None,
        input_timing: InputTiming::OverRow,
        driven: Input::Voltage,
        theta: None,
        theta_quantum: 0.0,
        current: None,
        temp_C: None,
        supply_ratio: None,
        connected: None,
        known_motion: None,
        rate_from_encoder: false,
        columns: Vec::new(),
        run_begins: vec![0],
        segments: vec![],
        channels: vec![channel],
        dt_s: ROW_S,
        held_out: None,
        budget: crate::budget::Budget::default(),
    }
}

fn rows() -> Vec<f64> {
    (0..ROWS).map(|k| k as f64 * ROW_S).collect()
}

fn rate(t_s: f64) -> f64 {
    (-t_s / TAU_S).exp()
}

fn angle(t_s: f64) -> f64 {
    TAU_S * (1.0 - rate(t_s))
}

/// Values of the channel at all rows, for the coast-down and one current per row.
fn shown<S: Scalar>(
    channel: ComparedChannel,
    t_s: &[f64],
    (skew_s, lag_s): (Option<S>, Option<S>),
    (current, slope): (&[f64], f64),
) -> Vec<Option<S>> {
    let data = prepared(t_s, channel);
    let mut chain = MeasurementChain::new(&data, 0, &Structure { skew_s, lag_s, ..Structure::default() });
    (0..t_s.len())
        .map(|k| {
            let dt_s = t_s.get(k + 1).map_or(ROW_S, |next| next - t_s[k]);
            let span = RowInput::new(t_s[k], dt_s, 0.0);
            let (omega, theta) = (S::from(rate(t_s[k])), S::from(angle(t_s[k])));
            let reading = Reading::of(omega, theta, S::from(current.get(k).copied().unwrap_or(0.0)));
            chain.push(&Row { input: &span, omega, theta, reading: &reading, current_slope_A_s: S::from(slope) })
        })
        .collect()
}

/// A row is 0.69 τ. Error of the cubic of the angle: at most 0.69⁴/384 τ, over the window 1e-3 of the rate. Error of the parabola of the
/// rate: 0.69³ √3/216 = 3e-3. Error of a straight line: 0.69²/8 = 6 %.
#[test]
fn delayed_rate_is_interpolated_within_the_row() {
    let t_s = rows();
    for late in [0.0, 0.0031, 0.0085, 0.0169, 0.02, 0.0333] {
        let instant = shown(compared(Channel::Rate, None), &t_s, (Some(late), None), (&[], 0.0));
        let mean = shown(compared(Channel::Rate, Some(ROW_S)), &t_s, (Some(late), None), (&[], 0.0));
        for k in 3..ROWS {
            let at = t_s[k] - late;
            // Relative to the rate at the start of the row.
            let size = rate(at - ROW_S);
            assert!((instant[k].unwrap() - rate(at)).abs() < 4e-3 * size, "{late} s late, row {k}");
            let expected = (angle(at) - angle(at - ROW_S)) / ROW_S;
            assert!((mean[k].unwrap() - expected).abs() < 1e-3 * size, "{late} s late, mean, row {k}: {:?} {expected}", mean[k]);
        }
        assert!(mean[0].is_none(), "the window reaches before the log");
    }
}

/// A window of 15 ms in rows of 20 ms.
#[test]
fn window_shorter_than_a_row_is_exact() {
    let t_s = rows();
    let mean = shown::<f64>(compared(Channel::Rate, Some(0.015)), &t_s, (None, None), (&[], 0.0));
    for k in 1..ROWS {
        let expected = (angle(t_s[k]) - angle(t_s[k] - 0.015)) / 0.015;
        assert!((mean[k].unwrap() - expected).abs() < 1e-3 * rate(t_s[k] - ROW_S), "row {k}");
    }
}

/// τ y' = ω − y from y = ω, then the mean over the row. Error of the parabola: at most 3e-3 of the rate, which the lag reduces.
#[test]
fn lag_and_window_act_within_the_row() {
    let (t_s, lag) = (rows(), 0.012);
    let part = TAU_S / (TAU_S - lag);
    let behind = |t: f64| part * rate(t) + (1.0 - part) * (-t / lag).exp();
    let sum = |t: f64| part * angle(t) + (1.0 - part) * lag * (1.0 - (-t / lag).exp());
    let instant = shown(compared(Channel::Rate, None), &t_s, (None, Some(lag)), (&[], 0.0));
    let mean = shown(compared(Channel::Rate, Some(ROW_S)), &t_s, (None, Some(lag)), (&[], 0.0));
    for k in 1..ROWS {
        let size = rate(t_s[k] - ROW_S);
        assert!((instant[k].unwrap() - behind(t_s[k])).abs() < 3e-3 * size, "row {k}");
        let expected = (sum(t_s[k]) - sum(t_s[k] - ROW_S)) / ROW_S;
        assert!((mean[k].unwrap() - expected).abs() < 3e-3 * size, "row {k}: {:?} {expected}", mean[k]);
    }
}

/// A filter of the logger whose time constant is shorter than a row, as that of a rate sensor in rows of 1 ms: as the lag of a sensor. A
/// straight line within the row would err by 6 %.
#[test]
fn filter_of_the_logger_acts_within_the_row() {
    let (t_s, lag) = (rows(), 0.006);
    let part = TAU_S / (TAU_S - lag);
    let behind = |t: f64| part * rate(t) + (1.0 - part) * (-t / lag).exp();
    let filter_hz = Some(1.0 / (std::f64::consts::TAU * lag));
    let filtered = shown::<f64>(ComparedChannel { filter_hz, ..compared(Channel::Rate, None) }, &t_s, (None, None), (&[], 0.0));
    for k in 1..ROWS {
        assert!(
            (filtered[k].unwrap() - behind(t_s[k])).abs() < 3e-3 * rate(t_s[k] - ROW_S),
            "row {k}: {:?} {}",
            filtered[k],
            behind(t_s[k])
        );
    }
    // A current is constant within the row: its filter sees straight lines between the rows.
    let current = [0.0, 1.0, 1.0, 1.0];
    let filtered =
        shown::<f64>(ComparedChannel { filter_hz, ..compared(Channel::Current, None) }, &t_s[..4], (None, None), (&current, 0.0));
    assert!(filtered[0] == Some(0.0) && filtered[3].is_some_and(|i| (0.99..1.0).contains(&i)), "{filtered:?}");
}

/// Central differences over 2e-7 s have an error of 1e-7 of slopes up to 1/τ.
#[test]
fn derivatives_by_delay_and_lag_are_exact() {
    let t_s = rows();
    let current: Vec<f64> = (0..ROWS).map(|k| if k % 3 == 0 { 2.0 } else { -0.5 * k as f64 }).collect();
    for (shows, window) in [
        (Channel::Rate, None),
        (Channel::Rate, Some(0.015)),
        (Channel::Angle, None),
        (Channel::Angle, Some(0.015)),
        (Channel::Current, None),
        (Channel::Current, Some(0.03)),
    ] {
        let (late, lag) = (0.0085, 0.004);
        let dual = shown::<Dual<8>>(
            compared(shows, window),
            &t_s,
            (Some(Dual::seeded(late, 0, 1.0)), Some(Dual::seeded(lag, 1, 1.0))),
            (&current, 0.0),
        );
        let plain = |late, lag| shown::<f64>(compared(shows, window), &t_s, (Some(late), Some(lag)), (&current, 0.0));
        let d = 1e-7;
        let (more, less) = (plain(late + d, lag), plain(late - d, lag));
        let (slower, faster) = (plain(late, lag + d), plain(late, lag - d));
        for k in 0..ROWS {
            let Some(value) = dual[k] else { continue };
            let by_delay = (more[k].unwrap() - less[k].unwrap()) / (2.0 * d);
            let by_lag = (slower[k].unwrap() - faster[k].unwrap()) / (2.0 * d);
            assert!((value.slope(0) - by_delay).abs() < 1e-5, "{shows:?} {window:?} row {k}: {} {by_delay}", value.slope(0));
            assert!((value.slope(1) - by_lag).abs() < 1e-5, "{shows:?} {window:?} row {k}: {} {by_lag}", value.slope(1));
        }
        assert!((3..ROWS).any(|k| dual[k].unwrap().slope(0) != 0.0), "{shows:?} {window:?}");
    }
}

/// Means over rows of 20 and 30 ms, delayed by 5 ms: each contains 5 ms of the previous row.
#[test]
fn delayed_current_is_a_running_mean() {
    let t_s = [0.0, 0.02, 0.05, 0.07];
    let late = shown::<f64>(compared(Channel::Current, None), &t_s, (Some(0.005), None), (&[1.0, 4.0, -2.0, 0.0], 0.0));
    let expected = [1.0, (25.0 * 4.0 + 5.0) / 30.0, (15.0 * -2.0 + 5.0 * 4.0) / 20.0, -0.5];
    for (late, expected) in late.iter().zip(expected) {
        assert!((late.unwrap() - expected).abs() < 1e-12, "{late:?} {expected}");
    }
}

/// "Mean over 40 ms before t" of a column of row means: the two rows before t.
#[test]
fn current_window_covers_the_previous_rows() {
    let mean = shown::<f64>(compared(Channel::Current, Some(0.04)), &rows()[..4], (None, None), (&[1.0, 3.0, 7.0, 9.0], 0.0));
    assert_eq!(mean[..2], [None, None]);
    assert!((mean[2].unwrap() - 2.0).abs() < 1e-12 && (mean[3].unwrap() - 5.0).abs() < 1e-12, "{mean:?}");
}

/// 10 A at the start of the first row, falling by 100 A/s: the value 5 ms before the second row depends on the first row only.
#[test]
fn delayed_instantaneous_current_is_causal() {
    let channel = ComparedChannel { instant: true, ..compared(Channel::Current, None) };
    let late = shown::<f64>(channel, &rows()[..2], (Some(0.005), None), (&[10.0, -10.0], -100.0));
    assert!((late[1].unwrap() - 8.5).abs() < 1e-12, "{late:?}");
}
