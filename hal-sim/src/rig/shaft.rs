//! Two masses on a shaft, with or without play.

use std::ops::{Add, Mul};

use super::{Rig, State, slide};
use crate::effects::{Scalar, Shaft};

impl<S: Scalar> Rig<S> {
    /// Motor and platform over `h`, in two parts where the play closes or opens within it.
    ///
    /// All torques and the friction act on the motor's side; the platform is driven by the shaft alone.
    pub(super) fn twist(&self, shaft: &Shaft<S>, start: &State<S>, end: &mut State<S>, torque: S, dry: S, h: f64) {
        let half_gap = shaft.gap.re() * 0.5;
        let side = Side::at(start, half_gap);
        self.twist_on(side, shaft, start, end, torque, dry, h);
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
        // Its derivative says how the instant moves with the parameters.
        let part = (edge - start.twist) / (end.twist - start.twist);
        if !(part > 0.0 && part < 1.0) {
            return;
        }
        let mut between = *end;
        self.twist_on(side, shaft, start, &mut between, torque, dry, part * h);
        let beyond = match side {
            Side::Free if edge > 0.0 => Side::Ahead,
            Side::Free => Side::Behind,
            _ => Side::Free,
        };
        self.twist_on(beyond, shaft, &between, end, torque, dry, (-part + 1.0) * h);
    }

    /// The same while the contact does not change: the twist by the implicit midpoint rule (stable at any stiffness), each mass then by
    /// [`slide`].
    #[expect(clippy::too_many_arguments, reason = "two bodies")]
    fn twist_on<H>(&self, side: Side, shaft: &Shaft<S>, start: &State<S>, end: &mut State<S>, torque: S, dry: S, h: H)
    where
        S: Mul<H, Output = S> + Add<H, Output = S>,
        H: Copy,
    {
        let motor_inertia = self.base.inertia * shaft.share;
        let platform_inertia = self.base.inertia - motor_inertia;
        let relative = start.motor_omega - start.omega;
        let side = match side {
            Side::Free => {
                self.turn(start, end, torque, dry, S::zero(), motor_inertia, platform_inertia, h);
                return;
            }
            Side::Ahead => shaft.gap * 0.5,
            Side::Behind => shaft.gap * -0.5,
        };
        let wound = start.twist - side;
        // What moves against each other without the shaft: dry friction opposes the motor's motion, or holds it, then the platform alone.
        let load = torque - shaft.stiffness * wound - shaft.damping * relative;
        let (drive, inverse) = if start.motor_omega == 0.0 && load.abs() <= dry {
            (S::zero(), platform_inertia.recip())
        } else {
            let forward = if start.motor_omega == 0.0 { load > 0.0 } else { start.motor_omega > 0.0 };
            let friction = if forward { dry } else { -dry };
            ((torque - friction) / motor_inertia, motor_inertia.recip() + platform_inertia.recip())
        };
        let k = shaft.stiffness * inverse;
        let c = shaft.damping * inverse;
        let middle = (relative + (drive - k * wound) * h * 0.5) / (c * h * 0.5 + k * h * h * 0.25 + 1.0);
        let through = shaft.stiffness * (wound + middle * h * 0.5) + shaft.damping * middle;
        self.turn(start, end, torque, dry, through, motor_inertia, platform_inertia, h);
    }

    #[expect(clippy::too_many_arguments, reason = "two bodies")]
    fn turn<H>(&self, start: &State<S>, end: &mut State<S>, torque: S, dry: S, through: S, motor: S, platform: S, h: H)
    where
        S: Mul<H, Output = S> + Add<H, Output = S>,
        H: Copy,
    {
        let (motor_omega, motor_turned) = slide(start.motor_omega, torque - through, dry, motor, h);
        end.motor_omega = motor_omega;
        let (omega, turned) = slide(start.omega, through, S::zero(), platform, h);
        end.omega = omega;
        end.theta = start.theta + turned;
        end.twist = start.twist + motor_turned - turned;
    }
}

/// Where the motor stands in the play.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    /// Between the flanks: no torque goes through.
    Free,
    /// Against the flank ahead.
    Ahead,
    /// Against the flank behind.
    Behind,
}

impl Side {
    /// On a flank it is the motion that says whether they touch.
    fn at<S: Scalar>(state: &State<S>, half_gap: f64) -> Side {
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
