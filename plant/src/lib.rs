//! What the monitors of a plant tell, kept: from CAN buses into a file or a database, at once or over NATS JetStream.
//!
//! | module | holds |
//! |---|---|
//! | [`item`] | one thing that was told, and its identity |
//! | [`numbering`] | numbers of 16 bits as an epoch and a number within it |
//! | [`hearing`] | frames of a bus, put together into items |
//! | [`sink`] | a store of items: they are durable when it returns |
//! | [`store`] | an SQLite file with its schema |
//! | [`database`] | a PostgreSQL database with the same schema |
//! | [`stream`] | a stream of NATS JetStream |
//! | [`gateway`] | buses into a sink |
//! | [`collection`] | a stream into a store |
//! | [`export`] | a file's days as Parquet |
//! | [`fleet`] | jobs over many machines, their queue and who works on them |
//! | [`live`] | pages of monitors, machines and jobs, and numbers for Prometheus |
//! | [`command`] | the command line |

pub mod collection;
pub mod command;
pub mod database;
pub mod export;
pub mod fleet;
pub mod gateway;
pub mod hearing;
pub mod item;
pub mod live;
mod names;
pub mod numbering;
pub mod sink;
pub mod store;
pub mod stream;
