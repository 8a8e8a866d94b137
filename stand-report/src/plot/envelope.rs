//! Condenses long series for plots and keeps their extremes.

/// Points of a line with gaps: one list for each piece.
pub type Pieces = Vec<Vec<(f64, f64)>>;

/// Lowest and highest point within each of `columns` equal intervals of `range`, in their order; a short series is unchanged. A piece ends
/// at a value that is not finite, and before a step in `x` above `longest_step`.
pub fn envelope(points: impl Iterator<Item = (f64, f64)>, range: (f64, f64), columns: usize, longest_step: f64) -> Pieces {
    let scale = columns as f64 / (range.1 - range.0).max(f64::MIN_POSITIVE);
    let mut pieces: Pieces = Vec::new();
    let mut piece: Vec<(f64, f64)> = Vec::new();
    let mut interval = Interval::default();
    let mut last_x = f64::NAN;
    for (x, y) in points.filter(|(x, _)| *x >= range.0 && *x <= range.1) {
        let broken = !y.is_finite() || x - last_x > longest_step;
        last_x = x;
        if broken {
            interval.end(&mut piece);
            if !piece.is_empty() {
                pieces.push(std::mem::take(&mut piece));
            }
            if !y.is_finite() {
                continue;
            }
        }
        let column = ((x - range.0) * scale) as usize;
        if interval.column != column {
            interval.end(&mut piece);
            interval.column = column;
        }
        interval.take(x, y);
    }
    interval.end(&mut piece);
    if !piece.is_empty() {
        pieces.push(piece);
    }
    pieces
}

/// Lowest and highest point of one interval.
#[derive(Default)]
struct Interval {
    column: usize,
    extremes: Option<((f64, f64), (f64, f64))>,
}

impl Interval {
    fn take(&mut self, x: f64, y: f64) {
        let (low, high) = self.extremes.unwrap_or(((x, y), (x, y)));
        self.extremes = Some((if y < low.1 { (x, y) } else { low }, if y > high.1 { (x, y) } else { high }));
    }

    fn end(&mut self, piece: &mut Vec<(f64, f64)>) {
        if let Some((low, high)) = self.extremes.take() {
            if low.0 <= high.0 {
                piece.push(low);
                if high.0 > low.0 {
                    piece.push(high);
                }
            } else {
                piece.push(high);
                piece.push(low);
            }
        }
    }
}

/// Lowest and highest value of all pieces; `None` where there are no points.
pub fn extent<'a>(pieces: impl Iterator<Item = &'a Pieces>) -> Option<(f64, f64)> {
    pieces.flatten().flatten().map(|p| p.1).fold(None, |range, y| {
        let (low, high) = range.unwrap_or((y, y));
        Some((y.min(low), y.max(high)))
    })
}
