//! Numbers as people write them.

/// A number with its unit, as people write it.
pub fn number(value: f64, unit: &str) -> String {
    let size = value.abs();
    let text = match size {
        _ if value.is_nan() => return "NaN".into(),
        _ if size == 0.0 => "0".into(),
        _ if (1e-3..1e6).contains(&size) => {
            let places = (5 - size.log10().floor() as i32).clamp(0, 9) as usize;
            let text = format!("{value:.places$}");
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_string()
            } else {
                text
            }
        }
        _ => format!("{value:.3e}"),
    };
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_have_six_digits_and_no_zeros_behind_them() {
        assert_eq!(number(1608.84, "N"), "1608.84 N");
        assert_eq!(number(0.1, "m"), "0.1 m");
        assert_eq!(number(2.5e-7, "m"), "2.500e-7 m");
        assert_eq!(number(123456.7, ""), "123457");
        assert_eq!(number(f64::NAN, "m"), "NaN");
    }
}
