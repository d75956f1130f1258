//! Postcard in a slice, with a checksum where it is stored. It is read so that the compiler sees the length of every number
//! and leaves no check that could panic, at whatever level it optimises.

use postcard::Deserializer;
use postcard::de_flavors::Flavor;
use serde::{Deserialize, Serialize};

use crate::checksum;

struct Unread<'a>(&'a [u8]);

impl<'a> Unread<'a> {
    #[inline(always)]
    fn take(&mut self, number: usize) -> postcard::Result<&'a [u8]> {
        let end = postcard::Error::DeserializeUnexpectedEnd;
        let taken = self.0.get(..number).ok_or(end)?;
        self.0 = self.0.get(number..).unwrap_or_default();
        Ok(taken)
    }
}

impl<'a> Flavor<'a> for Unread<'a> {
    type Remainder = &'a [u8];
    type Source = &'a [u8];

    #[inline(always)]
    fn pop(&mut self) -> postcard::Result<u8> {
        let (&first, rest) = self.0.split_first().ok_or(postcard::Error::DeserializeUnexpectedEnd)?;
        self.0 = rest;
        Ok(first)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }

    #[inline(always)]
    fn try_take_n(&mut self, number: usize) -> postcard::Result<&'a [u8]> {
        self.take(number)
    }

    #[inline(always)]
    fn try_take_n_temp<'b>(&'b mut self, number: usize) -> postcard::Result<&'b [u8]>
    where
        'a: 'b,
    {
        self.take(number)
    }

    fn finalize(self) -> postcard::Result<&'a [u8]> {
        Ok(self.0)
    }
}

/// A value and the bytes that follow it; `None` if the bytes are cut short or not such a value.
pub(crate) fn unpack<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<(T, &'a [u8])> {
    let mut deserializer = Deserializer::from_flavor(Unread(bytes));
    let value = T::deserialize(&mut deserializer).ok()?;
    Some((value, deserializer.finalize().ok()?))
}

/// A value that its checksum follows, as [`pack_checked`] writes it; bytes after that are ignored.
pub(crate) fn unpack_checked<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    let (value, rest) = unpack(bytes)?;
    let stated = u32::from_le_bytes(*rest.first_chunk()?);
    let covered = bytes.get(..bytes.len().checked_sub(rest.len())?)?;
    (checksum::of(covered) == stated).then_some(value)
}

/// Writes a value and its checksum to where bytes begin, and returns how many they are; `None` if there is no room.
pub(crate) fn pack_checked<T: Serialize>(value: &T, bytes: &mut [u8]) -> Option<usize> {
    let length = postcard::to_slice(value, bytes).ok()?.len();
    let (covered, rest) = bytes.split_at_mut_checked(length)?;
    let stated = rest.first_chunk_mut()?;
    *stated = checksum::of(covered).to_le_bytes();
    Some(length + stated.len())
}
