//! JSON as text, without what prints binary fractions shortly: that takes ten kilobytes of tables, which no compression makes smaller.

use serde_json::Value;
use std::fmt::Write;

/// The text of a value. A fraction is its exact decimal expansion, so that whoever reads it has the same bits.
pub fn text(value: &Value) -> String {
    let mut text = String::new();
    write(value, &mut text);
    text
}

fn write(value: &Value, to: &mut String) {
    match value {
        Value::Null => to.push_str("null"),
        Value::Bool(is) => to.push_str(if *is { "true" } else { "false" }),
        Value::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(number), _) => display(number, to),
            (_, Some(number)) => display(number, to),
            _ => fraction(number.as_f64().unwrap_or_default(), to),
        },
        Value::String(string) => quoted(string, to),
        Value::Array(items) => list(items, ['[', ']'], to, write),
        Value::Object(members) => list(members, ['{', '}'], to, |(name, value), to| {
            quoted(name, to);
            to.push(':');
            write(value, to);
        }),
    }
}

fn list<T>(
    items: impl IntoIterator<Item = T>,
    [open, close]: [char; 2],
    to: &mut String,
    one: impl Fn(T, &mut String),
) {
    to.push(open);
    for (k, item) in items.into_iter().enumerate() {
        if k > 0 {
            to.push(',');
        }
        one(item, to);
    }
    to.push(close);
}

fn quoted(string: &str, to: &mut String) {
    to.push('"');
    for c in string.chars() {
        match c {
            '"' | '\\' => to.extend(['\\', c]),
            '\0'..='\x1F' => display(format_args!("\\u{:04x}", u32::from(c)), to),
            _ => to.push(c),
        }
    }
    to.push('"');
}

/// A finite number: m 2^e is m 5^-e 10^e where e is negative.
fn fraction(number: f64, to: &mut String) {
    let bits = number.to_bits();
    let (low, high) = (bits & ((1 << 52) - 1), (bits >> 52 & 0x7FF) as i32);
    let mantissa = if high == 0 { low } else { low | 1 << 52 };
    if number.is_sign_negative() {
        to.push('-');
    }
    if mantissa == 0 {
        return to.push('0');
    }
    let exponent = high.max(1) - 1075 + mantissa.trailing_zeros() as i32;
    let mut digits = Digits::new(mantissa >> mantissa.trailing_zeros());
    let factor = if exponent < 0 { 5 } else { 2 };
    (0..exponent.unsigned_abs()).for_each(|_| digits.times(factor));
    digits.write(to);
    if exponent < 0 {
        to.push('e');
        display(exponent, to);
    }
}

/// A natural number in groups of nine digits, the last first.
struct Digits(Vec<u32>);

impl Digits {
    fn new(number: u64) -> Self {
        Self([0, 1].map(|k| (number / GROUP.pow(k) % GROUP) as u32).to_vec())
    }

    fn times(&mut self, factor: u32) {
        let mut carry = 0;
        for group in &mut self.0 {
            let product = u64::from(*group) * u64::from(factor) + carry;
            (*group, carry) = ((product % GROUP) as u32, product / GROUP);
        }
        if carry > 0 {
            self.0.push(carry as u32);
        }
    }

    fn write(&self, to: &mut String) {
        let first = self.0.iter().rposition(|&group| group > 0).unwrap_or(0);
        display(self.0[first], to);
        self.0[..first].iter().rev().for_each(|group| display(format_args!("{group:09}"), to));
    }
}

fn display(number: impl std::fmt::Display, to: &mut String) {
    // Writing to a string does not fail.
    let _ = write!(to, "{number}");
}

const GROUP: u64 = 1_000_000_000;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde_json::json;

    #[test]
    fn known_texts() {
        let told = |value: Value| text(&value);
        assert_eq!(
            told(json!([null, true, false, 0, -7, u64::MAX, {}, []])),
            format!("[null,true,false,0,-7,{},{{}},[]]", u64::MAX)
        );
        assert_eq!(
            told(json!({ "a\"\\": "\n\u{1f}\u{7f} é" })),
            "{\"a\\\"\\\\\":\"\\u000a\\u001f\u{7f} é\"}"
        );
        assert_eq!(
            told(json!([0.5, -0.0, 0.1, 3.0, 2f64.powi(70)])),
            "[5e-1,-0,1000000000000000055511151231257827021181583404541015625e-55,3,1180591620717411303424]"
        );
    }

    proptest! {
        #[test]
        fn fractions_are_exact(bits: u64) {
            let number = f64::from_bits(bits);
            prop_assume!(number.is_finite());
            let mut said = String::new();
            fraction(number, &mut said);
            prop_assert_eq!(said.parse::<f64>().unwrap().to_bits(), bits);
            prop_assert!(serde_json::from_str::<Value>(&said).is_ok());
        }
    }
}
