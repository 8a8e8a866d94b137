//! Decimation of rows for a slow serial line. A decimated row is the row of a slower loop.
//!
//! Over each group of rows: instantaneous values are those of the first row; the voltage and the currents of motor and torquer, which are
//! means over a row, are averaged, with the voltage's first moment; the limits are combined, the fault is the last one, and the age is the
//! greatest.

use super::{Row, RowSink};
use crate::config::{ConfigError, within};

/// Passes one row to `sink` for each group of `every` rows.
pub struct Decimate<S> {
    sink: S,
    every: u32,
    count: u32,
    group: Row,
}

impl<S: RowSink> Decimate<S> {
    /// Decimates by the factor `every`, 1 … 1000.
    ///
    /// # Errors
    /// `every` is out of its range.
    pub fn new(every: u32, sink: S) -> Result<Self, ConfigError> {
        within("every", f64::from(every), 1.0, 1000.0)?;
        Ok(Self { sink, every, count: 0, group: Row::default() })
    }

    /// Drops an incomplete group. For the start of a session.
    pub fn restart(&mut self) {
        self.count = 0;
    }

    /// The sink of the decimated rows.
    pub fn sink(&mut self) -> &mut S {
        &mut self.sink
    }
}

impl<S: RowSink> RowSink for Decimate<S> {
    fn row(&mut self, row: &Row) {
        let group = &mut self.group;
        if self.count == 0 {
            *group = *row;
        } else {
            // Sums for the moment about the middle of the group, which is known at its end.
            group.u_slope_V += row.u_slope_V + 6.0 * f64::from(self.count) * row.u_V;
            group.u_V += row.u_V;
            group.i_A = group.i_A.zip(row.i_A).map(|(sum, i_A)| sum + i_A);
            group.torquer_A = group.torquer_A.zip(row.torquer_A).map(|(sum, torquer_A)| sum + torquer_A);
            group.limits.0 |= row.limits.0;
            group.fault = row.fault;
            group.age = group.age.max(row.age);
        }
        self.count += 1;
        if self.count >= self.every {
            let scale = 1.0 / f64::from(self.count);
            group.u_slope_V = (group.u_slope_V * scale - 3.0 * (1.0 - scale) * group.u_V) * scale;
            group.u_V *= scale;
            group.i_A = group.i_A.map(|sum| sum * scale);
            group.torquer_A = group.torquer_A.map(|sum| sum * scale);
            self.count = 0;
            self.sink.row(&self.group);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::speed_loop::Limits;

    #[derive(Default)]
    struct Kept(Vec<Row>);
    impl RowSink for Kept {
        fn row(&mut self, row: &Row) {
            self.0.push(*row);
        }
    }

    #[test]
    fn instantaneous_values_are_from_the_first_row_and_means_over_the_group() {
        let mut decimate = Decimate::new(4, Kept::default()).unwrap();
        for k in 0..11_u32 {
            let x = f64::from(k);
            let limits = if k == 6 { Limits::CURRENT } else { Limits::default() };
            let row = Row {
                sequence: k,
                t_s: x,
                u_V: x,
                u_slope_V: 0.5,
                i_A: Some(2.0 * x),
                torquer_A: Some(3.0 * x),
                theta_rad: x * x,
                limits,
                ..Row::default()
            };
            decimate.row(&row);
        }
        let rows = &decimate.sink().0;
        assert_eq!(rows.len(), 2, "the third group is incomplete");
        assert_eq!((rows[1].sequence, rows[1].t_s, rows[1].theta_rad), (4, 4.0, 16.0));
        assert_eq!((rows[1].u_V, rows[1].i_A, rows[1].torquer_A), (5.5, Some(11.0), Some(16.5)));
        assert!((rows[1].u_slope_V - 2.0).abs() < 1e-12, "the line through the rows: 1 V per row, so 2 V from the middle to the end");
        assert!(rows[1].limits.contains(Limits::CURRENT) && !rows[0].limits.contains(Limits::CURRENT));
    }

    #[test]
    fn missing_current_stays_missing_and_invalid_factor_is_refused() {
        let mut decimate = Decimate::new(2, Kept::default()).unwrap();
        decimate.row(&Row { i_A: Some(1.0), ..Row::default() });
        decimate.row(&Row { i_A: None, ..Row::default() });
        assert_eq!(decimate.sink().0[0].i_A, None);
        assert_eq!(Decimate::new(0, Kept::default()).err().map(|e| e.parameter()), Some("every"));
    }
}
