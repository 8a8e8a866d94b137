//! Rotations of a platform in three gimbals, axes X (outer), Z, Y (inner): R = R_x R_z R_y, platform to base.

/// A vector in x, y, z.
pub type Vector = [f64; 3];

/// Rows of a rotation matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation(pub [Vector; 3]);

impl Rotation {
    /// The rotation of these gimbal angles about x, y, z, rad.
    pub fn of_gimbals([x, y, z]: Vector) -> Self {
        let ((sx, cx), (sy, cy), (sz, cz)) = (libm::sincos(x), libm::sincos(y), libm::sincos(z));
        Self([
            [cz * cy, -sz, cz * sy],
            [cx * sz * cy + sx * sy, cx * cz, cx * sz * sy - sx * cy],
            [sx * sz * cy - cx * sy, sx * cz, sx * sz * sy + cx * cy],
        ])
    }

    /// The gimbal angles about x, y, z, rad.
    pub fn gimbals(&self) -> Vector {
        let r = &self.0;
        [libm::atan2(r[2][1], r[1][1]), libm::atan2(r[0][2], r[0][0]), -libm::asin(r[0][1])]
    }

    /// The rotation of a rotation vector (Rodrigues).
    pub fn of_vector(v: Vector) -> Self {
        let angle = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        let k = [[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]];
        // sin x/x and (1 − cos x)/x², by series where x is small.
        let (first, second) = if angle < 1e-4 {
            (1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0)
        } else {
            (libm::sin(angle) / angle, (1.0 - libm::cos(angle)) / (angle * angle))
        };
        let mut r = [[0.0; 3]; 3];
        for (i, row) in r.iter_mut().enumerate() {
            for (j, element) in row.iter_mut().enumerate() {
                let square: f64 = (0..3).map(|m| k[i][m] * k[m][j]).sum();
                *element = f64::from(i == j) + first * k[i][j] + second * square;
            }
        }
        Self(r)
    }

    /// First `other`, in the axes of the platform.
    pub fn then(&self, other: &Self) -> Self {
        let mut product = [[0.0; 3]; 3];
        for (i, row) in product.iter_mut().enumerate() {
            for (j, element) in row.iter_mut().enumerate() {
                *element = (0..3).map(|m| self.0[i][m] * other.0[m][j]).sum();
            }
        }
        Self(product)
    }

    /// A vector of the base in the axes of the platform.
    pub fn into_platform(&self, v: Vector) -> Vector {
        std::array::from_fn(|j| (0..3).map(|i| self.0[i][j] * v[i]).sum())
    }
}

/// a × b.
pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Combines the components of a and b.
pub fn each(a: Vector, b: Vector, does: impl Fn(f64, f64) -> f64) -> Vector {
    std::array::from_fn(|k| does(a[k], b[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gimbal_angles_come_back_and_small_rotations_add() {
        let angles = [0.3, -0.2, 0.4];
        let back = Rotation::of_gimbals(angles).gimbals();
        assert!(back.iter().zip(angles).all(|(a, b)| (a - b).abs() < 1e-15), "{back:?}");
        for axis in 0..3 {
            let mut v = [0.0; 3];
            v[axis] = 1e-3;
            let (one, two) = (Rotation::of_vector(v), Rotation::of_gimbals(v));
            assert!((0..9).all(|n| (one.0[n / 3][n % 3] - two.0[n / 3][n % 3]).abs() < 1e-16), "axis {axis}");
        }
        // Both forms agree where they meet.
        let near = |a: f64| Rotation::of_vector([a, -a, 0.5 * a]);
        let (below, above) = (near(6.6e-5), near(6.7e-5));
        assert!((0..9).all(|n| (below.0[n / 3][n % 3] - above.0[n / 3][n % 3]).abs() < 1.1e-6));
    }
}
