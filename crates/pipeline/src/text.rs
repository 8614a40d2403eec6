//! Numbers in the sentences of findings.

/// A number with so many digits after the point, and no sign before zero.
pub(crate) fn fixed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let is_zero = !text.bytes().any(|c| (b'1'..=b'9').contains(&c));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::fixed;

    #[test]
    fn zero_has_no_sign_and_all_else_keeps_it() {
        let cases =
            [(-0.001, 2, "0.00"), (-0.0, 0, "0"), (1.3e-12, 1, "0.0"), (-0.006, 2, "-0.01"), (-12.04, 1, "-12.0")];
        for (value, digits, told) in cases {
            assert_eq!(fixed(value, digits), told);
        }
    }
}
