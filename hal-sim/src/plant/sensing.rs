//! Readings of the sensor elements: measurement effects, lag and delay of the rate.

use std::collections::VecDeque;

use super::outsiders::{BadLines, Outsiders, StickyRateSensor};
use drive_model::{Law, Point, Reading, Structure};

/// A law with its parameters.
pub(super) type LawParameters = (Box<dyn Law<f64>>, Vec<f64>);

/// Last readings of the elements.
pub(super) struct Sensing {
    /// Angle reading of the encoder disc, rad.
    pub theta_rad: f64,
    /// Rate reading of the sensor element, rad/s.
    pub rate_rad_s: f64,
    /// Current reading, A.
    pub current_A: f64,
    lag_s: f64,
    skew_s: f64,
    lines: Option<BadLines>,
    sticks: Option<StickyRateSensor>,
    stuck_rad_s: f64,
    lagged: f64,
    last_in: f64,
    t_s: f64,
    past: VecDeque<(f64, f64)>,
}

impl Sensing {
    pub(super) fn new(structure: &Structure<f64>, outsiders: &Outsiders) -> Self {
        Sensing {
            theta_rad: 0.0,
            rate_rad_s: 0.0,
            current_A: 0.0,
            lag_s: structure.lag_s.unwrap_or(0.0),
            skew_s: structure.skew_s.unwrap_or(0.0),
            lines: outsiders.bad_lines,
            sticks: outsiders.sticky_rate_sensor,
            stuck_rad_s: 0.0,
            lagged: 0.0,
            last_in: 0.0,
            t_s: 0.0,
            past: VecDeque::new(),
        }
    }

    /// Takes the state after `dt_s`; 0 initialises the elements without history.
    pub(super) fn take(&mut self, laws: &[LawParameters], x: &Point<f64>, omega: f64, theta: f64, current: f64, dt_s: f64) {
        let x = Point { omega, ..*x };
        let mut reading = Reading::of(omega, theta, current);
        for (law, parameters) in laws {
            law.measure(parameters, &x, &mut reading);
        }
        reading.theta += self.lines.map_or(0.0, |lines| lines.error_rad(theta));
        if let Some(sensor) = &self.sticks {
            let last = if dt_s > 0.0 { self.stuck_rad_s } else { reading.omega };
            reading.omega = sensor.reading_rad_s(reading.omega, last);
            self.stuck_rad_s = reading.omega;
        }
        self.theta_rad = reading.theta;
        self.current_A = reading.current;
        self.t_s += dt_s;
        if dt_s <= 0.0 {
            self.past.clear();
        }
        let lagged = self.lag(reading.omega, dt_s);
        self.rate_rad_s = self.late(lagged);
        self.last_in = reading.omega;
    }

    /// First-order low-pass, exact for a rate that is linear within the tick.
    fn lag(&mut self, rate: f64, dt_s: f64) -> f64 {
        if self.lag_s <= 0.0 || dt_s <= 0.0 {
            self.lagged = rate;
            return rate;
        }
        let decay = libm::exp(-dt_s / self.lag_s);
        let slope = (rate - self.last_in) * self.lag_s / dt_s;
        self.lagged = rate - slope + (self.lagged - self.last_in + slope) * decay;
        self.lagged
    }

    fn late(&mut self, rate: f64) -> f64 {
        if self.skew_s <= 0.0 {
            return rate;
        }
        self.past.push_back((self.t_s, rate));
        let wanted = self.t_s - self.skew_s;
        while self.past.len() > 2 && self.past[1].0 <= wanted {
            self.past.pop_front();
        }
        match (self.past.front(), self.past.get(1)) {
            (Some(a), Some(b)) if b.0 > a.0 && wanted > a.0 => a.1 + (b.1 - a.1) * ((wanted - a.0) / (b.0 - a.0)).min(1.0),
            (Some(a), _) => a.1,
            _ => rate,
        }
    }
}
