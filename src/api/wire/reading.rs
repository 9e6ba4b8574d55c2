//! How a request is read, handed to everything that reads a part of it.

use std::marker::PhantomData;

use bytes::Bytes;
use serde::Deserializer;
use serde::de::{DeserializeSeed, Error};

use crate::core::context::{Context, Pace};

/// What a reader goes by.
#[derive(Debug, Clone, Copy)]
pub struct Reading<'a> {
    context: &'a Context,
    /// The numbers of a raw request.
    numbers: Option<&'a Bytes>,
    goes_on: bool,
}

impl<'a> Reading<'a> {
    /// Of JSON, up to the first fault.
    pub fn new(context: &'a Context) -> Self {
        Reading { context, numbers: None, goes_on: false }
    }

    /// Lists may stand for these numbers, where there are any: see [`crate::api::wire::raw`].
    pub fn with_numbers(self, numbers: Option<&'a Bytes>) -> Self {
        Reading { numbers, ..self }
    }

    /// Beyond every fault, to the end: see [`crate::api::wire::tolerant`].
    pub(super) fn going_on(self) -> Self {
        Reading { goes_on: true, ..self }
    }

    /// What it is held to.
    pub fn context(&self) -> &'a Context {
        self.context
    }

    /// The numbers of a raw request.
    pub(super) fn numbers(&self) -> Option<&'a Bytes> {
        self.numbers
    }

    /// Whether it goes on after a fault; asked only where there is one.
    pub fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// Ends where nobody waits for the request any more.
    ///
    /// # Errors
    /// Of the format that is read; whoever asked for the value knows that it is cancelled.
    pub fn checkpoint<E: Error>(&self) -> Result<(), E> {
        self.context.checkpoint().map_err(E::custom)
    }

    /// The same for many short steps.
    pub(super) fn pace(&self) -> Pace<'a> {
        self.context.pace()
    }

    /// Reads a value as a part of what is read.
    pub(super) fn seed<T>(&self) -> Seed<'_, T> {
        Seed(self, PhantomData)
    }

    /// Reads a whole text, as [`serde_json::from_slice`] does.
    ///
    /// # Errors
    /// Not JSON, or not of this type.
    pub fn from_slice<'de, T: Read<'de>>(&self, text: &'de [u8]) -> serde_json::Result<T> {
        let mut parser = serde_json::Deserializer::from_slice(text);
        let value = T::read(self, &mut parser)?;
        parser.end().map(|()| value)
    }
}

/// What is read as a [`Reading`] says, as [`serde::Deserialize`] is read without one.
pub trait Read<'de>: Sized {
    /// Reads one.
    ///
    /// # Errors
    /// Whatever is not one.
    fn read<D: Deserializer<'de>>(reading: &Reading, deserializer: D) -> Result<Self, D::Error>;
}

/// Reads a value inside another.
pub(super) struct Seed<'r, T>(&'r Reading<'r>, PhantomData<T>);

impl<'de, T: Read<'de>> DeserializeSeed<'de> for Seed<'_, T> {
    type Value = T;

    #[inline]
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        T::read(self.0, deserializer)
    }
}
