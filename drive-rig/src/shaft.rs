//! Two masses on a shaft, with or without play.

use std::ops::{Add, Mul};

use crate::{DriveState, slide};
use drive_model::{Scalar, Shaft};

/// Motor and platform during a step, with what acts on them.
pub(super) struct TwoBodies<S> {
    /// Torque on the motor without shaft and Coulomb torque, N m.
    pub motor_torque: S,
    /// Coulomb torque on the motor, N m.
    pub coulomb_torque: S,
    /// Inertia of the motor, kg m².
    pub motor_inertia: S,
    /// Torque on the platform without the shaft, N m: only that of an inertia that varies with the angle.
    pub platform_torque: S,
    /// Inertia of the platform, kg m².
    pub platform_inertia: S,
}

impl<S: Scalar> TwoBodies<S> {
    /// Advances motor and platform over `h`, in two parts if the play closes or opens within the step.
    pub(super) fn twist(&self, shaft: &Shaft<S>, start: &DriveState<S>, end: &mut DriveState<S>, h: f64) {
        let half_gap = shaft.gap.re() * 0.5;
        let side = Side::at(start, half_gap);
        self.twist_on(side, shaft, start, end, h);
        if half_gap <= 0.0 {
            return;
        }
        let edge = match side {
            Side::Free if end.twist > half_gap => shaft.gap * 0.5,
            Side::Free if -end.twist > half_gap => shaft.gap * -0.5,
            Side::Ahead if end.twist < half_gap => shaft.gap * 0.5,
            Side::Behind if -end.twist < half_gap => shaft.gap * -0.5,
            _ => return,
        };
        let rates = (start.motor_omega - start.omega, end.motor_omega - end.omega);
        let Some(part) = crossing(start.twist - edge, end.twist - edge, rates.0 * h, rates.1 * h) else { return };
        let mut between = *end;
        self.twist_on(side, shaft, start, &mut between, part * h);
        let beyond = match side {
            Side::Free if edge > 0.0 => Side::Ahead,
            Side::Free => Side::Behind,
            _ => Side::Free,
        };
        self.twist_on(beyond, shaft, &between, end, (-part + 1.0) * h);
    }

    /// As [`TwoBodies::twist`] for an unchanged contact: both masses by the series of [`TwoBodies::swing`]. If the shaft is too stiff, or
    /// the motor comes to rest: the twist by the implicit midpoint rule (stable at any stiffness), then each mass by [`slide`].
    fn twist_on<H>(&self, side: Side, shaft: &Shaft<S>, start: &DriveState<S>, end: &mut DriveState<S>, h: H)
    where
        S: Mul<H, Output = S> + Add<H, Output = S>,
        H: Copy,
    {
        let relative = start.motor_omega - start.omega;
        let side = match side {
            Side::Free => {
                self.turn(start, end, S::zero(), h);
                return;
            }
            Side::Ahead => shaft.gap * 0.5,
            Side::Behind => shaft.gap * -0.5,
        };
        let wound = start.twist - side;
        // Accelerations without the shaft torque: Coulomb friction opposes the motion of the motor, or holds the motor.
        let load = self.motor_torque - shaft.stiffness * wound - shaft.damping * relative;
        let (motor, inverse) = if start.motor_omega == 0.0 && load.abs() <= self.coulomb_torque {
            (S::zero(), self.platform_inertia.recip())
        } else {
            let forward = if start.motor_omega == 0.0 { load > 0.0 } else { start.motor_omega > 0.0 };
            let friction = if forward { self.coulomb_torque } else { -self.coulomb_torque };
            ((self.motor_torque - friction) / self.motor_inertia, self.motor_inertia.recip() + self.platform_inertia.recip())
        };
        let drive = motor - self.platform_torque / self.platform_inertia;
        let k = shaft.stiffness * inverse;
        let c = shaft.damping * inverse;
        if start.motor_omega != 0.0 && self.swing(start, end, motor, (wound, k, c), h) {
            return;
        }
        let middle = (relative + (drive - k * wound) * h * 0.5) / (c * h * 0.5 + k * h * h * 0.25 + 1.0);
        let through = shaft.stiffness * (wound + middle * h * 0.5) + shaft.damping * middle;
        self.turn(start, end, through, h);
    }

    /// Oscillation of motor against platform while the motor slides: the twist x'' = a − k x − c x' by its Taylor series up to h⁵, the
    /// common motion exactly. `motor` is the acceleration of the motor without the shaft. Returns whether the result is valid: the series
    /// converges, and the motor did not come to rest.
    fn swing<H>(&self, start: &DriveState<S>, end: &mut DriveState<S>, motor: S, (wound, k, c): (S, S, S), h: H) -> bool
    where
        S: Mul<H, Output = S>,
        H: Copy,
    {
        let (square, damped) = ((k * h * h).re(), (c * h).re());
        if square > SERIES * SERIES || damped > SERIES {
            return false;
        }
        let fraction = self.motor_inertia / (self.motor_inertia + self.platform_inertia);
        let platform = self.platform_torque / self.platform_inertia;
        let relative = start.motor_omega - start.omega;
        let d2 = motor - platform - k * wound - c * relative;
        let d3 = -(k * relative) - c * d2;
        let d4 = -(k * d2) - c * d3;
        let d5 = -(k * d3) - c * d4;
        let twisted = (((d5 * h / 120.0 + d4 / 24.0) * h + d3 / 6.0) * h + d2 / 2.0) * h * h + relative * h;
        let gained = (((d5 * h / 24.0 + d4 / 6.0) * h + d3 / 2.0) * h + d2) * h;
        // Change of the rate of the common centre of mass.
        let common = (motor * fraction + platform * (-fraction + 1.0)) * h;
        let motor_omega = start.motor_omega + common + gained - fraction * gained;
        if (motor_omega * start.motor_omega).re() <= 0.0 {
            return false;
        }
        end.motor_omega = motor_omega;
        end.omega = start.omega + common - fraction * gained;
        end.theta = start.theta + (start.omega + common / 2.0) * h + fraction * (relative * h - twisted);
        end.twist = start.twist + twisted;
        true
    }

    /// Each mass by itself, with the torque `through` the shaft.
    fn turn<H>(&self, start: &DriveState<S>, end: &mut DriveState<S>, through: S, h: H)
    where
        S: Mul<H, Output = S> + Add<H, Output = S>,
        H: Copy,
    {
        let (motor_omega, motor_turned) = slide(start.motor_omega, self.motor_torque - through, self.coulomb_torque, self.motor_inertia, h);
        end.motor_omega = motor_omega;
        let (omega, turned) = slide(start.omega, self.platform_torque + through, S::zero(), self.platform_inertia, h);
        end.omega = omega;
        end.theta = start.theta + turned;
        end.twist = start.twist + motor_turned - turned;
    }
}

/// Longest step for the series, as phase of the undamped oscillation and as decay: error at most 10⁻⁶.
const SERIES: f64 = 0.3;
/// Newton steps to the time of a contact change, each kept within the known bracket.
const NEWTON_STEPS: usize = 8;

/// Fraction of the step, 0 … 1, at which the cubic with these end values and slopes passes zero; `None` without a zero. (A straight line
/// would err by a h²/8v: at a slow contact far more than the error of the step.) Its derivatives are those of the contact time with
/// respect to the parameters.
fn crossing<S: Scalar>(from: S, to: S, slope_from: S, slope_to: S) -> Option<S> {
    let (a, b, c, d) = (from.re(), to.re(), slope_from.re(), slope_to.re());
    let passes = a * b < 0.0;
    if !passes {
        return None;
    }
    // Hermite cubic: f = a + s (c + s (p + s q)).
    let (p, q) = (3.0 * (b - a) - 2.0 * c - d, 2.0 * (a - b) + c + d);
    let (mut low, mut high) = (0.0, 1.0);
    let mut s = a / (a - b);
    for _ in 0..NEWTON_STEPS {
        let value = a + s * (c + s * (p + s * q));
        if value * a > 0.0 {
            low = s
        } else {
            high = s
        }
        let next = s - value / (c + s * (2.0 * p + s * 3.0 * q));
        s = if next > low && next < high { next } else { 0.5 * (low + high) };
    }
    let slope = c + s * (2.0 * p + s * 3.0 * q);
    if slope == 0.0 {
        return None;
    }
    // The last step in dual numbers: it yields the derivatives of the contact time.
    let [square, cube] = [s * s, s * s * s];
    let value = from * (1.0 - 3.0 * square + 2.0 * cube)
        + to * (3.0 * square - 2.0 * cube)
        + slope_from * (s - 2.0 * square + cube)
        + slope_to * (cube - square);
    Some(-(value / slope) + s).filter(|s| *s > 0.0 && *s < 1.0)
}

/// Position of the motor within the play.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    /// Between the flanks: no torque is transmitted.
    Free,
    /// Against the flank ahead.
    Ahead,
    /// Against the flank behind.
    Behind,
}

impl Side {
    /// Exactly at a flank, the direction of motion decides about contact.
    fn at<S: Scalar>(state: &DriveState<S>, half_gap: f64) -> Side {
        let (twist, relative) = (state.twist.re(), (state.motor_omega - state.omega).re());
        if half_gap <= 0.0 || twist > half_gap || (twist == half_gap && relative > 0.0) {
            Side::Ahead
        } else if -twist > half_gap || (-twist == half_gap && relative < 0.0) {
            Side::Behind
        } else {
            Side::Free
        }
    }
}
