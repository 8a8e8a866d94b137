//! Instructions to the operator of a session, as data and as the English text that the journal keeps.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Mounting, Orientation, StepPlan};

/// Something that the operator does before a step.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Action {
    /// What the session file asks for, in its own words.
    Stated {
        /// The text.
        text: String,
    },
    /// Mount the device under test.
    Mount {
        /// Distance from the platform's axis, m.
        radius_m: f64,
        /// Rotation about the platform's axis, degrees.
        turned_deg: f64,
        /// Orientation.
        orientation: Orientation,
        /// Tilt of the platform's axis, degrees.
        tilt_deg: f64,
    },
    /// Put an inertia on the platform.
    AddInertia {
        /// Its moment of inertia, kg m².
        added_kg_m2: f64,
    },
    /// Remove the added inertia.
    RemoveInertia,
}

impl std::fmt::Display for Action {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Action::Stated { text } => f.write_str(text),
            Action::Mount { radius_m, turned_deg, orientation, tilt_deg } => {
                let orientation = match orientation {
                    Orientation::Flat => "its sensitive axis parallel to the platform's axis",
                    Orientation::Side => "on its side, its y along the platform's axis",
                    Orientation::OtherSide => "on its other side, its y opposite to the platform's axis",
                };
                write!(
                    f,
                    "Mount the device at a radius of {radius_m} m, turned by {turned_deg}°, {orientation}; tilt the stand by {tilt_deg}°."
                )
            }
            Action::AddInertia { added_kg_m2 } => {
                write!(f, "Put an inertia of {added_kg_m2} kg m² on the platform, centred on its axis.")
            }
            Action::RemoveInertia => f.write_str("Remove the added inertia from the platform."),
        }
    }
}

/// What the operator does before a step, in this order; empty: nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Instruction(pub Vec<Action>);

impl Instruction {
    /// The instruction before a step: the session's own, or what leads from the current mounting and added inertia to the next.
    pub(super) fn before(plan: &StepPlan, current: (Mounting, f64), next: (Mounting, f64)) -> Self {
        if let Some(text) = &plan.instruction {
            return Instruction(vec![Action::Stated { text: text.clone() }]);
        }
        let Mounting { radius_m, turned_deg, tilt_deg, orientation } = next.0;
        let mount = (current.0 != next.0).then_some(Action::Mount { radius_m, turned_deg, orientation, tilt_deg });
        let load = (current.1 != next.1).then_some(match next.1 {
            0.0 => Action::RemoveInertia,
            added_kg_m2 => Action::AddInertia { added_kg_m2 },
        });
        Instruction(mount.into_iter().chain(load).collect())
    }

    /// There is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl std::fmt::Display for Instruction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "))
    }
}
