//! Values as bytes, in the encoding of postcard 1: an f32 as four bytes, little endian; a u8 as it is; a larger whole number
//! as seven bits a byte, the lowest first, with the top bit set in each byte but the last; a list as its length in a byte
//! (there is none of 128 entries or more) before the entries; an option as 0 or 1 before its value; arrays and structs as
//! their entries alone.

use core::slice;

use heapless::Vec;
use nalgebra::{ArrayStorage, SVector};

use crate::checksum::{self, Digest};
use crate::model_error::ModelError;

/// A value with an encoding.
pub(crate) trait Packed {
    /// What a list's entry is before it is read.
    const EMPTY: Self;
    /// The fault of a list with more of these than there is room for.
    const TOO_MANY: ModelError = ModelError::Encoding;

    fn write(&self, to: &mut impl Sink);

    /// Reads over the present value, which is of no use after a fault of the reader.
    fn read(&mut self, from: &mut Reader);
}

/// Implements [`Packed`] for a struct: its fields in the order of their encoding. Its generic parameters stand after `where`.
macro_rules! packed {
    ($type:ty $(where [$($generic:tt)*])? { $($field:ident),* $(,)? } $(, too many: $too_many:expr)?) => {
        impl $(<$($generic)*>)? crate::packed::Packed for $type {
            const EMPTY: Self = Self { $($field: crate::packed::Packed::EMPTY),* };
            $(const TOO_MANY: crate::model_error::ModelError = $too_many;)?

            fn write(&self, to: &mut impl crate::packed::Sink) {
                $(self.$field.write(to);)*
            }

            fn read(&mut self, from: &mut crate::packed::Reader) {
                $(self.$field.read(from);)*
            }
        }
    };
}
pub(crate) use packed;

/// Where bytes go.
pub(crate) trait Sink {
    fn put(&mut self, byte: u8);

    fn put_numbers(&mut self, numbers: &[f32]) {
        for number in numbers {
            for byte in number.to_le_bytes() {
                self.put(byte);
            }
        }
    }
}

/// Writes to a buffer; `None` once it was too small.
struct Writer<'a> {
    rest: Option<&'a mut [u8]>,
}

impl Sink for Writer<'_> {
    fn put(&mut self, byte: u8) {
        let place = self.rest.take().and_then(|rest| rest.split_first_mut());
        self.rest = place.map(|(place, rest)| {
            *place = byte;
            rest
        });
    }
}

impl Sink for Digest {
    fn put(&mut self, byte: u8) {
        self.update(&[byte]);
    }
}

/// Writes nothing, and sees whether every f32 is finite.
struct IsFinite(bool);

impl Sink for IsFinite {
    fn put(&mut self, _: u8) {}

    #[inline(never)] // once in flash
    fn put_numbers(&mut self, numbers: &[f32]) {
        self.0 &= numbers.iter().all(|number| number.is_finite());
    }
}

/// Takes values off bytes. After a fault nothing more is read.
pub(crate) struct Reader<'a> {
    rest: Result<&'a [u8], ModelError>,
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: Ok(bytes) }
    }

    /// The bytes that are left.
    ///
    /// Errors: the first fault, [`ModelError::Encoding`] or that of a list.
    pub fn rest(&self) -> Result<&'a [u8], ModelError> {
        self.rest
    }

    #[inline(never)] // once in flash
    fn refuse(&mut self, fault: ModelError) {
        self.rest = self.rest.and(Err(fault));
    }

    #[inline(never)] // once in flash
    fn byte(&mut self) -> u8 {
        let Some((&byte, rest)) = self.rest.unwrap_or_default().split_first() else {
            self.refuse(ModelError::Encoding);
            return 0;
        };
        self.rest = Ok(rest);
        byte
    }

    #[inline(never)] // once in flash
    fn numbers(&mut self, numbers: &mut [f32]) {
        for number in numbers {
            let Some((bytes, rest)) = self.rest.unwrap_or_default().split_first_chunk() else {
                return self.refuse(ModelError::Encoding);
            };
            self.rest = Ok(rest);
            *number = f32::from_le_bytes(*bytes);
        }
    }

    /// A whole number of so many bits.
    #[inline(never)] // once in flash
    fn whole(&mut self, bits: u32) -> u32 {
        let (mut value, mut shift) = (0, 0);
        while shift < bits {
            let byte = self.byte();
            let part = u32::from(byte & 0x7f);
            if part.checked_shr(bits - shift).is_some_and(|beyond| beyond != 0) {
                break;
            }
            value |= part << shift;
            if byte & 0x80 == 0 {
                return value;
            }
            shift += 7;
        }
        self.refuse(ModelError::Encoding);
        0
    }

    /// Whether a variant or an option is the second of two.
    pub fn is_second(&mut self) -> bool {
        let byte = self.byte();
        if byte > 1 {
            self.refuse(ModelError::Encoding);
        }
        byte == 1
    }
}

/// A value that its checksum follows, as [`pack_checked`] writes it; bytes after that are ignored. `None` if the bytes are
/// cut short or not such a value.
pub(crate) fn unpack_checked<T: Packed>(bytes: &[u8]) -> Option<T> {
    let mut value = T::EMPTY;
    let mut reader = Reader::new(bytes);
    value.read(&mut reader);
    confirmed(bytes, reader.rest().ok()?).map(|_| value)
}

/// The checksum of the bytes before `rest`, if it stands at the beginning of that.
pub(crate) fn confirmed(bytes: &[u8], rest: &[u8]) -> Option<u32> {
    let covered = bytes.get(..bytes.len().checked_sub(rest.len())?)?;
    let stated = u32::from_le_bytes(*rest.first_chunk()?);
    (checksum::of(covered) == stated).then_some(stated)
}

/// Writes a value to where bytes begin, and returns how many they are; `None` if there is no room.
pub(crate) fn pack(value: &impl Packed, bytes: &mut [u8]) -> Option<usize> {
    let room = bytes.len();
    let mut writer = Writer { rest: Some(bytes) };
    value.write(&mut writer);
    Some(room - writer.rest?.len())
}

/// Writes a value and its checksum, in the same way.
pub(crate) fn pack_checked(value: &impl Packed, bytes: &mut [u8]) -> Option<usize> {
    let length = pack(value, bytes)?;
    let (covered, rest) = bytes.split_at_mut_checked(length)?;
    let stated = rest.first_chunk_mut()?;
    *stated = checksum::of(covered).to_le_bytes();
    Some(length + stated.len())
}

/// The checksum that [`pack_checked`] appends.
pub(crate) fn checksum_of(value: &impl Packed) -> u32 {
    let mut digest = checksum::begin();
    value.write(&mut digest);
    digest.finalize()
}

/// Every f32 of a value is finite.
pub(crate) fn is_finite(value: &impl Packed) -> bool {
    let mut sink = IsFinite(true);
    value.write(&mut sink);
    sink.0
}

fn write_whole(mut number: u32, to: &mut impl Sink) {
    while number >= 0x80 {
        to.put(number as u8 | 0x80);
        number >>= 7;
    }
    to.put(number as u8);
}

impl Packed for u8 {
    const EMPTY: Self = 0;

    fn write(&self, to: &mut impl Sink) {
        to.put(*self);
    }

    fn read(&mut self, from: &mut Reader) {
        *self = from.byte();
    }
}

impl Packed for u16 {
    const EMPTY: Self = 0;

    fn write(&self, to: &mut impl Sink) {
        write_whole(u32::from(*self), to);
    }

    fn read(&mut self, from: &mut Reader) {
        *self = from.whole(Self::BITS) as Self;
    }
}

impl Packed for u32 {
    const EMPTY: Self = 0;

    fn write(&self, to: &mut impl Sink) {
        write_whole(*self, to);
    }

    fn read(&mut self, from: &mut Reader) {
        *self = from.whole(Self::BITS);
    }
}

impl Packed for f32 {
    const EMPTY: Self = 0.0;

    fn write(&self, to: &mut impl Sink) {
        to.put_numbers(slice::from_ref(self));
    }

    fn read(&mut self, from: &mut Reader) {
        from.numbers(slice::from_mut(self));
    }
}

impl<const LENGTH: usize> Packed for [u8; LENGTH] {
    const EMPTY: Self = [0; LENGTH];

    fn write(&self, to: &mut impl Sink) {
        self.iter().for_each(|byte| byte.write(to));
    }

    fn read(&mut self, from: &mut Reader) {
        self.iter_mut().for_each(|byte| byte.read(from));
    }
}

impl<const LENGTH: usize> Packed for [f32; LENGTH] {
    const EMPTY: Self = [0.0; LENGTH];

    fn write(&self, to: &mut impl Sink) {
        to.put_numbers(self);
    }

    fn read(&mut self, from: &mut Reader) {
        from.numbers(self);
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Packed for [[f32; COLUMNS]; ROWS] {
    const EMPTY: Self = [[0.0; COLUMNS]; ROWS];

    fn write(&self, to: &mut impl Sink) {
        to.put_numbers(self.as_flattened());
    }

    fn read(&mut self, from: &mut Reader) {
        from.numbers(self.as_flattened_mut());
    }
}

impl<const LENGTH: usize> Packed for SVector<f32, LENGTH> {
    const EMPTY: Self = SVector::from_array_storage(ArrayStorage([[0.0; LENGTH]]));

    fn write(&self, to: &mut impl Sink) {
        self.data.0.write(to);
    }

    fn read(&mut self, from: &mut Reader) {
        self.data.0.read(from);
    }
}

impl<T: Packed> Packed for Option<T> {
    const EMPTY: Self = None;

    fn write(&self, to: &mut impl Sink) {
        to.put(u8::from(self.is_some()));
        if let Some(value) = self {
            value.write(to);
        }
    }

    fn read(&mut self, from: &mut Reader) {
        *self = None;
        if from.is_second() {
            self.insert(T::EMPTY).read(from);
        }
    }
}

impl<T: Packed, const MOST: usize> Packed for Vec<T, MOST> {
    const EMPTY: Self = Vec::new();

    fn write(&self, to: &mut impl Sink) {
        to.put(self.len() as u8);
        self.iter().for_each(|entry| entry.write(to));
    }

    fn read(&mut self, from: &mut Reader) {
        self.clear();
        // No list has 128 entries or more.
        let length = from.byte();
        if usize::from(length) > MOST {
            from.refuse(if length < 128 { T::TOO_MANY } else { ModelError::Encoding });
            return;
        }
        for _ in 0..length {
            let mut entry = T::EMPTY;
            entry.read(from);
            let _ = self.push(entry); // there is room
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a value and says how many bytes are left.
    fn unpack<T: Packed>(bytes: &[u8]) -> Option<(T, usize)> {
        let mut value = T::EMPTY;
        let mut reader = Reader::new(bytes);
        value.read(&mut reader);
        Some((value, reader.rest().ok()?.len()))
    }

    #[track_caller]
    fn assert_packed<T: Packed + PartialEq + core::fmt::Debug>(value: T, expected: &[u8]) {
        let mut bytes = [0xee; 16];
        assert_eq!(pack(&value, &mut bytes), Some(expected.len()));
        assert_eq!(&bytes[..expected.len()], expected);
        for length in 0..expected.len() {
            assert_eq!(unpack::<T>(&expected[..length]), None, "cut to {length}");
            assert_eq!(pack(&value, &mut [0; 16][..length]), None);
        }
        assert_eq!(unpack::<T>(&bytes), Some((value, bytes.len() - expected.len())));
    }

    #[test]
    fn values_have_the_encoding_of_postcard() {
        assert_packed(7_u8, &[7]);
        assert_packed(127_u16, &[0x7f]);
        assert_packed(300_u16, &[0xac, 0x02]);
        assert_packed(u16::MAX, &[0xff, 0xff, 0x03]);
        assert_packed(u32::MAX, &[0xff, 0xff, 0xff, 0xff, 0x0f]);
        assert_packed(1.5_f32, &[0, 0, 0xc0, 0x3f]);
        assert_packed([[1.5_f32], [-2.0]], &[0, 0, 0xc0, 0x3f, 0, 0, 0, 0xc0]);
        assert_packed(SVector::<f32, 1>::new(1.5), &[0, 0, 0xc0, 0x3f]);
        assert_packed(None::<u16>, &[0]);
        assert_packed(Some(300_u16), &[1, 0xac, 0x02]);
        assert_packed(Vec::<u8, 3>::from_slice(&[5, 6]).unwrap(), &[2, 5, 6]);
        assert_packed(*b"P-1 ", b"P-1 ");
    }

    #[test]
    fn bytes_that_are_no_value_are_refused() {
        assert_eq!(unpack::<Option<u8>>(&[2, 1]), None);
        assert_eq!(unpack::<Vec<u8, 1>>(&[2, 5, 6]), None);
        assert_eq!(unpack::<Vec<u8, 1>>(&[0xff; 9]), None);
        assert_eq!(unpack::<u16>(&[0xff, 0xff, 0x04]), None, "17 bits");
        assert_eq!(unpack::<u16>(&[0x80, 0x80, 0x80, 0x00]), None, "four bytes");
        assert_eq!(unpack::<u32>(&[0xff, 0xff, 0xff, 0xff, 0x10]), None, "33 bits");
    }
}
