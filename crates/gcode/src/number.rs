//! Decimal numbers in and out.

/// Powers of ten that are exact in double precision.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// The number that the text is: a sign or none, digits, at most one point. Correctly rounded.
pub fn parse(text: &[u8]) -> Option<f64> {
    let (negative, digits) = match text.split_first()? {
        (b'-', rest) => (true, rest),
        (b'+', rest) => (false, rest),
        _ => (false, text),
    };
    let (mut mantissa, mut count, mut decimals, mut point) = (0_u64, 0_usize, 0_usize, false);
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                // Beyond 19 digits the quotient below is not taken, so that wrapping does no harm.
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                count += 1;
                decimals += usize::from(point);
            }
            b'.' if !point => point = true,
            _ => return None,
        }
    }
    if count == 0 {
        return None;
    }
    // Both are exact, so that one division rounds correctly.
    let size = if count <= 19 && mantissa < 1 << 53 && decimals < POWERS.len() {
        mantissa as f64 / POWERS[decimals]
    } else {
        std::str::from_utf8(digits).ok()?.parse().ok()?
    };
    Some(if negative { -size } else { size })
}

/// A number rounded to a decimal fraction: `count` units of 10^-`digits`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decimal {
    count: i64,
    digits: u32,
}

impl Decimal {
    /// The nearest one. The value must be below 10^9 and `digits` at most 9.
    pub fn nearest(value: f64, digits: u32) -> Self {
        Decimal { count: (value * POWERS[digits as usize]).round() as i64, digits }
    }

    /// Its value, as a controller reads it.
    pub fn value(self) -> f64 {
        self.count as f64 / POWERS[self.digits as usize]
    }

    /// Writes it: no exponent, no zeros at the end, never -0, and always with its point: a number without
    /// one counts in the smallest unit on some controls.
    pub fn write(self, out: &mut Vec<u8>) {
        let mut rest = self.count.unsigned_abs();
        let mut decimals = self.digits;
        while decimals > 0 && rest.is_multiple_of(10) {
            rest /= 10;
            decimals -= 1;
        }
        let mut text = [0_u8; 24];
        let mut at = text.len();
        if decimals == 0 {
            at -= 1;
            text[at] = b'.';
        }
        let mut place = 0;
        while rest > 0 || place <= decimals {
            if place == decimals && decimals > 0 {
                at -= 1;
                text[at] = b'.';
            }
            at -= 1;
            text[at] = b'0' + (rest % 10) as u8;
            rest /= 10;
            place += 1;
        }
        if self.count < 0 {
            at -= 1;
            text[at] = b'-';
        }
        out.extend_from_slice(&text[at..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(value: f64, digits: u32) -> String {
        let mut out = Vec::new();
        Decimal::nearest(value, digits).write(&mut out);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn numbers_are_read_as_the_standard_library_reads_them() {
        for text in [
            "0",
            "1",
            "-1",
            "+1",
            ".5",
            "5.",
            "-.5",
            "12.345678901234567890123",
            "0.1",
            "9007199254740993",
            "123456789012345678901234567890",
            "0.000000000000000000000001",
            "99999999999999999999.5",
            "1.7976931348623157",
        ] {
            let expected: f64 = text.parse().unwrap();
            assert_eq!(parse(text.as_bytes()).unwrap().to_bits(), expected.to_bits(), "{text}");
        }
        for text in ["", ".", "-", "+", "1.2.3", "--1", "+-1", "1-", "1e5", "inf"] {
            assert_eq!(parse(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn decimals_are_short_and_fixed() {
        for (value, digits, expected) in [
            (0.0, 6, "0."),
            (-0.0, 6, "0."),
            (-0.000_000_4, 6, "0."),
            (1.5, 6, "1.5"),
            (-1.5, 6, "-1.5"),
            (100.0, 6, "100."),
            (0.000_001, 6, "0.000001"),
            (-0.01, 6, "-0.01"),
            (123.456_789_4, 6, "123.456789"),
            (7.0, 0, "7."),
            (70.0, 0, "70."),
            (999_999_999.0, 7, "999999999."),
        ] {
            assert_eq!(written(value, digits), expected);
        }
    }

    #[test]
    fn what_is_written_is_read_back_as_its_value() {
        let mut state = 7_u64;
        for _ in 0..100_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let value = (state >> 11) as f64 / (1_u64 << 53) as f64 * 2000.0 - 1000.0;
            let decimal = Decimal::nearest(value, 6);
            let mut out = Vec::new();
            decimal.write(&mut out);
            assert_eq!(parse(&out), Some(decimal.value()));
            assert!((decimal.value() - value).abs() <= 0.500_1e-6);
        }
    }
}
