//! The coordinates of a residual.

/// A coordinate over which a residual is analysed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinate {
    /// Angle within the turn.
    Theta,
    /// Rate.
    Omega,
    /// Current.
    Current,
    /// Winding temperature.
    Temperature,
    /// Time since the start.
    Time,
    /// Angular acceleration.
    Acceleration,
    /// The preceding motion: reversals.
    History,
    /// The log, where several are compared together.
    Log,
}

impl Coordinate {
    /// All of them.
    pub const ALL: [Coordinate; 8] = [
        Coordinate::Theta,
        Coordinate::Omega,
        Coordinate::Current,
        Coordinate::Temperature,
        Coordinate::Time,
        Coordinate::Acceleration,
        Coordinate::History,
        Coordinate::Log,
    ];

    /// Name in the answers.
    pub fn name(self) -> &'static str {
        match self {
            Coordinate::Theta => "theta",
            Coordinate::Omega => "omega",
            Coordinate::Current => "current",
            Coordinate::Temperature => "temperature",
            Coordinate::Time => "time",
            Coordinate::Acceleration => "acceleration",
            Coordinate::History => "history",
            Coordinate::Log => "log",
        }
    }
}
