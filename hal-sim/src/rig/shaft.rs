//! Two masses on a shaft, with or without play.

use super::{Rig, State, slide};
use crate::effects::{Scalar, Shaft};

impl<S: Scalar> Rig<S> {
    /// Motor and platform over `h`: the twist by the implicit midpoint rule (stable at any stiffness), each mass then by [`slide`].
    ///
    /// All torques and the friction act on the motor's side; the platform is driven by the shaft alone.
    pub(super) fn twist(&self, shaft: &Shaft<S>, start: &State<S>, end: &mut State<S>, torque: S, dry: S, h: f64) {
        let motor_inertia = self.base.inertia * shaft.share;
        let platform_inertia = self.base.inertia - motor_inertia;
        let relative = start.motor_omega - start.omega;
        let half_gap = shaft.gap * 0.5;
        // Which side of the gap is in contact at the middle of the step, judged by the free motion.
        let ahead = start.twist + relative * (0.5 * h);
        let side = if ahead > half_gap {
            half_gap
        } else if -ahead > half_gap {
            -half_gap
        } else {
            self.turn(start, end, torque, dry, S::zero(), motor_inertia, platform_inertia, h);
            return;
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
        let middle = (relative + (drive - k * wound) * (0.5 * h)) / (c * (0.5 * h) + k * (0.25 * h * h) + 1.0);
        let through = shaft.stiffness * (wound + middle * (0.5 * h)) + shaft.damping * middle;
        self.turn(start, end, torque, dry, through, motor_inertia, platform_inertia, h);
    }

    #[expect(clippy::too_many_arguments, reason = "two bodies")]
    fn turn(&self, start: &State<S>, end: &mut State<S>, torque: S, dry: S, through: S, motor: S, platform: S, h: f64) {
        let (motor_omega, motor_turned) = slide(start.motor_omega, torque - through, dry, motor, h);
        end.motor_omega = motor_omega;
        let (omega, turned) = slide(start.omega, through, S::zero(), platform, h);
        end.omega = omega;
        end.theta = start.theta + turned;
        end.twist = start.twist + motor_turned - turned;
    }
}
