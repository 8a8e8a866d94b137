//! The experiment that demonstrates an effect on its page, and its words.

use drive_model::{Abscissa, Card, Coordinate, Demonstration, Domain, Motion, Output};

/// The experiment for this effect: that of its card, or the usual one of its domain and coordinate.
pub fn demonstration(card: &Card) -> Demonstration {
    card.demonstration.unwrap_or_else(|| usual(card))
}

/// The experiment that suits domain and coordinate.
fn usual(card: &Card) -> Demonstration {
    let output = if card.domain == Domain::Measurement { Output::Rate } else { Output::Current };
    let base =
        |motion, duration_s| Demonstration { motion, duration_s, output, abscissa: Abscissa::Coordinate(card.coordinate), added: &[] };
    match card.coordinate {
        Coordinate::Theta => base(Motion::Constant(2.0), 7.0),
        Coordinate::Omega => base(Motion::Triangle(20.0, 8.0), 8.0),
        Coordinate::Current => {
            let output = if card.domain == Domain::Electrical { Output::Voltage } else { output };
            Demonstration { output, ..base(Motion::Sine(20.0, 1.0), 2.0) }
        }
        Coordinate::Temperature => Demonstration { added: &[Demonstration::WEIGHT], ..base(Motion::Constant(20.0), 60.0) },
        Coordinate::Time | Coordinate::Log => base(Motion::Constant(10.0), 10.0),
        Coordinate::Acceleration => Demonstration { output: Output::Rate, ..base(Motion::VoltageSteps(2.0, 1.0), 2.0) },
        Coordinate::History => base(Motion::Sine(5.0, 2.0), 4.0),
    }
}

/// The motion as a clause.
pub fn motion_text(motion: Motion) -> String {
    match motion {
        Motion::Off => "the drive is off".to_owned(),
        Motion::Constant(0.0) => "the rate is controlled to zero".to_owned(),
        Motion::Constant(rate) => format!("the rate is controlled to {rate} rad/s"),
        Motion::Triangle(rate, period) => {
            format!("the rate follows a triangle between +{rate} and −{rate} rad/s with a period of {period} s")
        }
        Motion::Sine(rate, period) => format!("the rate follows a sine of {rate} rad/s with a period of {period} s"),
        Motion::VoltageSteps(volt, period) => format!("the voltage steps between +{volt} and −{volt} V with a period of {period} s"),
    }
}

/// Name and unit of the plotted quantity, for an axis.
pub fn output_label(output: Output) -> (&'static str, &'static str) {
    match output {
        Output::Current => ("current", "A"),
        Output::Voltage => ("commanded voltage", "V"),
        Output::Rate => ("rate of the rate sensor", "rad/s"),
        Output::EncoderRate => ("rate of the encoder", "rad/s"),
    }
}
