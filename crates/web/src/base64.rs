//! Bytes as text (RFC 4648), as a page sends them on.

const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Bytes as text.
pub fn text(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for part in bytes.chunks(3) {
        let word =
            (0..3).fold(0, |word, at| word << 8 | part.get(at).map_or(0, |&byte| u32::from(byte)));
        for at in 0..4 {
            let letter = char::from(LETTERS[(word >> (18 - 6 * at) & 63) as usize]);
            text.push(if at <= part.len() { letter } else { '=' });
        }
    }
    text
}

/// The bytes of a text; None where it is none of such.
pub fn bytes(text: &str) -> Option<Vec<u8>> {
    let letters = text.trim_end_matches('=').as_bytes();
    if !text.len().is_multiple_of(4) || text.len() - letters.len() > 2 {
        return None;
    }
    let mut bytes = Vec::with_capacity(letters.len() * 3 / 4);
    for part in letters.chunks(4) {
        let mut word = 0;
        for at in 0..4 {
            let value = match part.get(at) {
                None => 0,
                Some(letter) => LETTERS.iter().position(|known| known == letter)? as u32,
            };
            word = word << 6 | value;
        }
        bytes.extend((0..part.len() * 3 / 4).map(|at| (word >> (16 - 8 * at)) as u8));
    }
    Some(bytes)
}
