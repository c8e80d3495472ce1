//! Numbers as a digit and a power of ten.

/// A number with some decimals of its leading digit, as in print: 5e-15 is "5·10⁻¹⁵".
pub fn power_of_ten(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$e}");
    let Some((digits, exponent)) = text.split_once('e') else { return text };
    let raised = exponent.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        // The others are in a row in Unicode.
        c => c.to_digit(10).and_then(|digit| char::from_u32(0x2070 + digit)).unwrap_or(c),
    });
    match exponent {
        "0" => digits.to_owned(),
        _ => format!("{digits}·10{}", raised.collect::<String>()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_in_print() {
        assert_eq!(power_of_ten(5.2e-15, 0), "5·10⁻¹⁵");
        assert_eq!(power_of_ten(3.74e-7, 1), "3.7·10⁻⁷");
        assert_eq!(power_of_ten(-2.0e20, 0), "-2·10²⁰");
        assert_eq!(power_of_ten(1.0, 1), "1.0");
        assert_eq!(power_of_ten(f64::NAN, 1), "NaN");
    }
}
