//! Numbers of any number of bits, least significant bit first.

/// Bits on their way into bytes.
#[derive(Clone, Default)]
pub(super) struct BitWriter {
    bytes: Vec<u8>,
    len: usize,
}

impl BitWriter {
    /// The low `width` bits of a number, at most 64.
    pub fn put(&mut self, value: u64, width: u32) {
        let mut done = 0;
        while done < width {
            if self.len.is_multiple_of(8) {
                self.bytes.push(0);
            }
            let free = 8 - (self.len % 8) as u32;
            let now = free.min(width - done);
            let part = (value >> done) & ((1 << now) - 1);
            *self.bytes.last_mut().expect("just pushed") |= (part as u8) << (8 - free);
            self.len += now as usize;
            done += now;
        }
    }

    /// Elias's gamma code of `value + 2^k`, its top `k` bits known: short for small numbers.
    pub fn golomb(&mut self, value: u64, k: u32) {
        let v = value + (1 << k);
        let more = v.ilog2() - k;
        self.put((1 << more) - 1, more + 1);
        self.put(v, v.ilog2());
    }

    /// Signed numbers, those near zero short.
    pub fn signed(&mut self, value: i64, k: u32) {
        self.golomb(((value << 1) ^ (value >> 63)) as u64, k);
    }

    /// A time in seconds: single precision where that is exact.
    pub fn seconds(&mut self, t: f64) {
        let short = t as f32 as f64 == t;
        self.put(u64::from(!short), 1);
        if short { self.put((t as f32).to_bits().into(), 32) } else { self.put(t.to_bits(), 64) }
    }

    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.len
    }

    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// Bytes behind which enough zeros stand that any number can be read in one piece.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Bits {
    padded: Vec<u8>,
}

/// Zeros behind the last byte.
const PAD: usize = 8;

impl Bits {
    pub fn new(bytes: &[u8]) -> Self {
        Self { padded: [bytes, &[0; PAD]].concat() }
    }

    pub fn bytes(&self) -> &[u8] {
        &self.padded[..self.padded.len() - PAD]
    }

    pub fn len(&self) -> usize {
        8 * (self.padded.len() - PAD)
    }

    /// `width` bits from bit `at` on, at most 32.
    #[inline]
    pub fn get(&self, at: usize, width: u32) -> u32 {
        let bytes = self.padded[at / 8..at / 8 + 8].try_into().expect("eight bytes");
        (u64::from_le_bytes(bytes) >> (at % 8) & ((1 << width) - 1)) as u32
    }

    /// The same as a number in two's complement.
    #[inline]
    pub fn get_signed(&self, at: usize, width: u32) -> i32 {
        let v = self.get(at, width);
        if width == 0 { 0 } else { (v << (32 - width)) as i32 >> (32 - width) }
    }
}

/// Reads one number after the other; `None` past the end.
pub(super) struct BitReader<'a> {
    pub bits: &'a Bits,
    pub at: usize,
}

impl BitReader<'_> {
    /// Step over so many bits.
    pub fn skip(&mut self, width: usize) -> Option<usize> {
        let at = self.at;
        self.at = at.checked_add(width).filter(|&end| end <= self.bits.len())?;
        Some(at)
    }

    pub fn get(&mut self, width: u32) -> Option<u32> {
        let at = self.skip(width as usize)?;
        Some(self.bits.get(at, width))
    }

    /// Numbers below 2³¹ alone: nothing that is stored needs more.
    pub fn golomb(&mut self, k: u32) -> Option<u32> {
        let mut more = 0;
        while self.get(1)? == 1 {
            more += 1;
        }
        let width = Some(more + k).filter(|w| *w < 31)?;
        Some((1 << width) + self.get(width)? - (1 << k))
    }

    pub fn signed(&mut self, k: u32) -> Option<i32> {
        let v = self.golomb(k)?;
        Some((v >> 1) as i32 ^ -((v & 1) as i32))
    }

    pub fn seconds(&mut self) -> Option<f64> {
        let t = match self.get(1)? {
            0 => f32::from_bits(self.get(32)?) as f64,
            _ => f64::from_bits(u64::from(self.get(32)?) | u64::from(self.get(32)?) << 32),
        };
        t.is_finite().then_some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back() {
        let mut w = BitWriter::default();
        let numbers = [0, 1, 2, 7, 8, 1000, (1 << 30) - 2];
        for v in numbers {
            w.golomb(v, 0);
            w.golomb(v, 5);
            w.put(v, 32);
            w.signed(v as i64 / -3, 2);
        }
        w.seconds(0.1);
        w.seconds(0.25);
        let bits = Bits::new(&w.clone().into_bytes());
        let mut r = BitReader { bits: &bits, at: 0 };
        for v in numbers {
            assert_eq!([r.golomb(0), r.golomb(5), r.get(32)], [Some(v as u32); 3]);
            assert_eq!(r.signed(2), Some((v as i64 / -3) as i32));
        }
        assert_eq!((r.seconds(), r.seconds()), (Some(0.1), Some(0.25)));
        assert!(r.at == w.len() && r.get(32).is_none());
        assert_eq!(Bits::new(&[0b1110]).get_signed(1, 3), -1);
    }
}
