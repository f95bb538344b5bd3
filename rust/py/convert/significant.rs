//! Numbers for people: as many digits as are proven, at most nine.

/// Digits at most.
const MAX_DIGITS: usize = 9;

/// A number whose error is at most `width`: its last digit is of that order.
pub fn proven(value: f64, width: f64) -> String {
    let size = value.abs();
    let known =
        if width > 0.0 { size.log10().floor() - width.log10().floor() + 1.0 } else { MAX_DIGITS as f64 };
    let digits = if known.is_finite() { known.clamp(1.0, MAX_DIGITS as f64) as usize } else { MAX_DIGITS };
    significant(value, digits)
}

/// A number of so many significant digits, without zeros at its end.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{}", value + 0.0);
    }
    let scientific = format!("{value:.*e}", digits.max(1) - 1);
    let Some((mantissa, exponent)) = scientific.split_once('e') else { return scientific };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-5..digits.max(MAX_DIGITS) as i32).contains(&exponent) {
        let places = (digits as i32 - 1 - exponent).max(0) as usize;
        // Rounded once, at the last digit that is kept.
        let rounded = scientific.parse().unwrap_or(value);
        return trimmed(&format!("{rounded:.places$}")).to_string();
    }
    format!("{}e{exponent:+03}", trimmed(mantissa))
}

fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}
