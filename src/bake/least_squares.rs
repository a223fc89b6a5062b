//! Small linear least squares.

/// Solves H x = y, H symmetric with its lower half given, by Cholesky's factors: L L' = H; L z = y; L' x = z. `None` where H is not
/// positive definite.
pub fn solve<const N: usize>(mut h: [[f64; N]; N], y: [f64; N], n: usize) -> Option<[f64; N]> {
    let mut x = y;
    for i in 0..n {
        for j in 0..=i {
            let rest = h[i][j] - (0..j).map(|k| h[i][k] * h[j][k]).sum::<f64>();
            h[i][j] = if i == j { rest.sqrt() } else { rest / h[j][j] };
        }
        x[i] = (x[i] - (0..i).map(|k| h[i][k] * x[k]).sum::<f64>()) / h[i][i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| h[k][i] * x[k]).sum::<f64>()) / h[i][i];
    }
    x[..n].iter().all(|x| x.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_is_definite_and_says_what_is_not() {
        let h = [[4.0, 9.0, 9.0], [2.0, 5.0, 9.0], [1.0, 3.0, 6.0]];
        // H (1, -2, 3) with the upper half mirrored.
        let x = solve(h, [4.0 - 4.0 + 3.0, 2.0 - 10.0 + 9.0, 1.0 - 6.0 + 18.0], 3).unwrap();
        assert!(x.iter().zip([1.0, -2.0, 3.0]).all(|(a, b): (&f64, f64)| (a - b).abs() < 1e-12), "{x:?}");
        assert_eq!(solve([[1.0, 0.0], [2.0, 1.0]], [1.0, 1.0], 2), None);
        // Only the first of two unknowns.
        let first = solve([[2.0, 0.0], [9.0, 9.0]], [1.0, 7.0], 1).unwrap()[0];
        assert!((first - 0.5).abs() < 1e-12, "{first}");
    }
}
