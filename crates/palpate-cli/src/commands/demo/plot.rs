//! Line plot for the terminal, in braille characters of two by four dots.

/// Curve.
pub struct Curve<'a> {
    /// Label.
    pub label: &'a str,
    /// Values at equal intervals.
    pub values: &'a [f64],
}

const WIDTH: usize = 68;
const HEIGHT: usize = 9;

/// Draws curves, one below the other, over the time from 0 to `duration_s`, with a common scale.
pub fn plot(curves: &[Curve], unit: &str, duration_s: f64) -> String {
    let mut out = String::new();
    let finite = curves.iter().flat_map(|curve| curve.values).copied().filter(|v| v.is_finite());
    let high = finite.clone().fold(0.0, f64::max);
    let low = finite.fold(0.0, f64::min);
    let span = if high > low { high - low } else { 1.0 };
    for curve in curves {
        let mut dots = vec![[0_u8; WIDTH]; HEIGHT];
        let row_of = |value: f64| {
            let share = ((high - value) / span).clamp(0.0, 1.0);
            (share * (4 * HEIGHT - 1) as f64).round() as usize
        };
        let mut last: Option<usize> = None;
        for column in 0..2 * WIDTH {
            let at = column * curve.values.len().saturating_sub(1) / (2 * WIDTH - 1).max(1);
            let Some(&value) = curve.values.get(at).filter(|v| v.is_finite()) else {
                last = None;
                continue;
            };
            let row = row_of(value);
            let from = last.unwrap_or(row);
            for r in from.min(row)..=from.max(row) {
                dots[r / 4][column / 2] |= bit(column % 2, r % 4);
            }
            last = Some(row);
        }
        let zero = row_of(0.0) / 4;
        out.push_str(&format!("  {} [{unit}]\n", curve.label));
        for (at, line) in dots.iter().enumerate() {
            let label = match at {
                0 => format!("{high:>9.3}"),
                _ if at == HEIGHT - 1 => format!("{low:>9.3}"),
                _ if at == zero => format!("{:>9}", 0),
                _ => " ".repeat(9),
            };
            let axis = if at == zero { '┼' } else { '│' };
            let text: String =
                line.iter().map(|&bits| char::from_u32(0x2800 + u32::from(bits)).unwrap_or(' ')).collect();
            out.push_str(&format!("{label} {axis}{}\n", text.trim_end_matches('\u{2800}')));
        }
    }
    let end = format!("{duration_s} s");
    let line = "─".repeat(WIDTH);
    out.push_str(&format!("{:>9} └{line}\n{:>12}{end:>width$}\n", "", "0", width = WIDTH - 1));
    out
}

/// Bit of a dot in Unicode's braille pattern.
fn bit(column: usize, row: usize) -> u8 {
    [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]][column][row]
}
