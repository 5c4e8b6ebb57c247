//! Numbers of text whose file declares no types, for attributes.

use crate::mesh::attributes::Values;

use super::text::number;

/// A number of an attribute. It need not be finite, and what C's libraries write for such (`-nan(ind)`, `1.#QNAN`) is one, too.
#[inline]
pub(super) fn attribute(word: &[u8]) -> Option<f64> {
    number(word).or_else(|| is_no_number(word).then_some(f64::NAN))
}

#[cold]
fn is_no_number(word: &[u8]) -> bool {
    let word = word.strip_prefix(b"-").unwrap_or(word).to_ascii_lowercase();
    word.starts_with(b"nan(") || word.starts_with(b"1.#")
}

/// Numbers as they come: binary32 as long as that tells all their decimals, as it does where a program wrote them from binary32
/// or with six digits; else binary64.
pub(super) struct Decimals {
    numbers: Vec<f64>,
    narrow: bool,
    /// Whether all are written as integers from 0 to 255.
    bytes: bool,
}

impl Default for Decimals {
    fn default() -> Self {
        Self { numbers: Vec::new(), narrow: true, bytes: true }
    }
}

impl Decimals {
    /// The number `x` that a word is.
    #[inline]
    pub(super) fn push(&mut self, word: &[u8], x: f64) {
        self.narrow = self.narrow && is_narrow(word, x);
        self.bytes = self.bytes && word.iter().all(u8::is_ascii_digit) && x <= 255.0;
        self.numbers.push(x);
    }

    pub(super) fn len(&self) -> usize {
        self.numbers.len()
    }

    pub(super) fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// Without every third one, which is 0.
    pub(super) fn without_third(mut self) -> Self {
        let mut place = 0;
        self.numbers.retain(|_| {
            place += 1;
            place % 3 != 0
        });
        self
    }

    /// Whether they are integers that stand for fractions of 255: all are integers from 0 to 255, and not all are 0 or 1.
    pub(super) fn are_bytes(&self) -> bool {
        self.bytes && self.numbers.iter().any(|&x| x > 1.0)
    }

    pub(super) fn values(self) -> Values {
        if self.narrow {
            Values::F32(self.numbers.iter().map(|&x| x as f32).collect())
        } else {
            Values::F64(self.numbers)
        }
    }
}

/// Whether the nearest binary32 number is the number itself, or has its decimals.
#[inline]
fn is_narrow(word: &[u8], x: f64) -> bool {
    // Six digits are always told by binary32, where they are no smaller than its smallest normal number (FLT_DIG of C).
    let digits = word.iter().filter(|b| b.is_ascii_digit()).count();
    let leading = usize::from(word.iter().find(|b| b.is_ascii_digit()) == Some(&b'0'));
    let plain = word.len() <= 16 && word.iter().all(|b| matches!(b, b'0'..=b'9' | b'.' | b'-'));
    plain && digits - leading <= 6 || has_decimals_of_binary32(x)
}

fn has_decimals_of_binary32(x: f64) -> bool {
    let near = x as f32;
    f64::from(near) == x || x.is_nan() || near.is_finite() && near.to_string().parse() == Ok(x)
}

/// Colours of three or four numbers, as they come.
#[derive(Default)]
pub(super) struct Colours {
    rgb: Decimals,
    /// One a colour; 0 where it has none.
    alpha: Decimals,
    /// Colours without alpha.
    opaque: Vec<usize>,
}

impl Colours {
    /// Takes a colour by its words; returns its number, or nothing where they are no three or four numbers.
    pub(super) fn push(&mut self, words: &[&[u8]]) -> Option<u32> {
        let numbers: Vec<f64> = words.iter().map_while(|word| attribute(word)).collect();
        if numbers.len() != words.len() || !(3..=4).contains(&numbers.len()) {
            return None;
        }
        let place = self.alpha.len();
        for (word, x) in words.iter().zip(numbers).take(3) {
            self.rgb.push(word, x);
        }
        match words.get(3) {
            Some(word) => self.alpha.push(word, attribute(word).unwrap_or_default()),
            None => {
                self.alpha.push(b"0", 0.0);
                self.opaque.push(place);
            }
        }
        u32::try_from(place).ok()
    }

    /// All colours: numbers a colour, the numbers, and whether they are integers that stand for fractions. Where some have alpha,
    /// the others are opaque.
    pub(super) fn finish(mut self) -> (usize, Values, bool) {
        let bytes = self.alpha.bytes && self.rgb.are_bytes();
        let most = if bytes { 255.0 } else { 1.0 };
        self.opaque.iter().for_each(|&place| self.alpha.numbers[place] = most);
        let (components, numbers) = if self.opaque.len() == self.alpha.len() {
            (3, self.rgb)
        } else {
            let narrow = self.rgb.narrow && self.alpha.narrow;
            let pairs = self.rgb.numbers.chunks_exact(3).zip(&self.alpha.numbers);
            let numbers = pairs.flat_map(|(rgb, &alpha)| [rgb[0], rgb[1], rgb[2], alpha]).collect();
            (4, Decimals { numbers, narrow, bytes })
        };
        if bytes {
            (components, Values::U8(numbers.numbers.iter().map(|&x| x as u8).collect()), true)
        } else {
            (components, numbers.values(), false)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(words: &[&str]) -> Values {
        let mut decimals = Decimals::default();
        for word in words {
            decimals.push(word.as_bytes(), attribute(word.as_bytes()).unwrap());
        }
        decimals.values()
    }

    #[test]
    fn binary32_where_it_tells_all_decimals() {
        for narrow in
            ["0.1", "0.123456", "-0.000001", "12345.6", "1e-30", "16777216", "0.70710677", "nan", "-inf"]
        {
            let word = narrow.parse::<f32>().unwrap();
            let Values::F32(list) = values(&[narrow]) else { panic!("{narrow}") };
            assert!(list[0].to_bits() == word.to_bits() || word.is_nan() && list[0].is_nan(), "{narrow}");
        }
        // Its seven digits are those of a binary32 number; eight of another are not.
        for wide in ["0.70710678118", "1.00000001", "16777217", "1e39", "0.1234567891"] {
            assert_eq!(values(&["0.5", wide]), Values::F64(vec![0.5, wide.parse().unwrap()]));
        }
        // The decimals that binary64 has of a binary32 number.
        assert_eq!(values(&["0.10000000149011612"]), Values::F32(vec![0.1]));
        for word in ["-nan", "-nan(ind)", "nan(snan)", "1.#QNAN", "-1.#IND00"] {
            assert!(attribute(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        assert_eq!([attribute(b"1,5"), attribute(b""), attribute(b"nano")], [None; 3]);
    }

    #[test]
    fn colours_by_bytes_or_fractions() {
        let all = |colours: &[&str]| {
            let mut all = Colours::default();
            for (k, colour) in colours.iter().enumerate() {
                let words: Vec<&[u8]> = colour.split(' ').map(str::as_bytes).collect();
                assert_eq!(all.push(&words), Some(k as u32));
            }
            all.finish()
        };
        assert_eq!(all(&["255 0 1", "2 3 4"]), (3, Values::U8(vec![255, 0, 1, 2, 3, 4]), true));
        assert_eq!(all(&["255 0 1", "2 3 4 0"]), (4, Values::U8(vec![255, 0, 1, 255, 2, 3, 4, 0]), true));
        // Ones are whole ones where nothing is more.
        assert_eq!(all(&["1 0 0"]), (3, Values::F32(vec![1.0, 0.0, 0.0]), false));
        assert_eq!(
            all(&["1 0 0 0.5", "1 1 1"]),
            (4, Values::F32(vec![1.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0]), false)
        );
        assert_eq!(all(&["256 0 0"]), (3, Values::F32(vec![256.0, 0.0, 0.0]), false));
        let mut none = Colours::default();
        let pushed = [none.push(&[b"1", b"2"]), none.push(&[b"1", b"2", b"x"]), none.push(&[&b"1"[..]; 5])];
        assert_eq!(pushed, [None; 3]);
    }
}
