//! A stream of NATS JetStream: a gateway publishes to its own server, whose leaf node sends on what it has stored.
//!
//! An item is a message on `rotor_edge.PLANT.BUS.NODE.KIND`, a JSON object. Its id makes the server store it once within
//! [`DUPLICATES`]; whoever collects it knows it by source, kind, epoch and sequence for ever.

pub mod access;
mod claim;
pub mod server;

use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, anyhow};
use async_nats::jetstream;
use async_nats::jetstream::consumer::{AckPolicy, PullConsumer, pull};
use async_nats::jetstream::message::{AckKind, PublishMessage};
use async_nats::jetstream::stream::{Config, External, Source as Leaf, StorageType};
use futures_util::{StreamExt as _, TryStreamExt as _, future};

use crate::item::{Item, Kind, SCHEMA, plain_word};
use crate::numbering::Last;
use crate::sink::Sink;
use access::Access;
use server::{Server, refused};

pub const STREAM: &str = "ROTOR_EDGE";
/// Name of the stream of what leaf nodes store; a server takes one that feeds on its own name for a circle.
const HUB_STREAM: &str = "ROTOR_EDGE_HUB";
/// How long the server remembers ids, which takes some 300 bytes of its memory each. What is sent again later than that is in
/// the stream twice, and stored once.
pub const DUPLICATES: Duration = Duration::from_secs(120);
/// A message that is not acknowledged by then is handed out again; one that was stored meanwhile is stored once.
const ACKNOWLEDGED_WITHIN: Duration = Duration::from_secs(5);
/// Between two fetches of what is taken together.
const BETWEEN: Duration = Duration::from_millis(50);
/// Messages handed out and not acknowledged, at most.
const MOST_PENDING: i64 = 20_000;

/// A connection to the stream.
pub struct Stream {
    server: Server,
    stream: jetstream::stream::Stream,
}

impl Stream {
    /// Connects, and makes the stream if there is none: of what gateways
    /// publish to this server, or of the streams of its leaf nodes, each the JetStream domain of one.
    ///
    /// # Errors
    /// One sentence if there is no server, if it wants other credentials, or if it has no JetStream.
    pub fn open(address: &str, access: &Access, leaves: &[String]) -> Result<Self> {
        let server = Server::connect(address, access)?;
        let config = Config {
            name: STREAM.into(),
            storage: StorageType::File,
            duplicate_window: DUPLICATES,
            ..Config::default()
        };
        let stream = server.wait(async {
            if leaves.is_empty() {
                return anyhow::Ok(server.context.get_or_create_stream(config).await?);
            }
            let of_leaf = |domain: &String| Leaf {
                name: STREAM.into(),
                external: Some(External { api_prefix: format!("$JS.{domain}.API"), delivery_prefix: None }),
                ..Leaf::default()
            };
            // what somebody else has set of it stays
            let known =
                server.context.get_stream(HUB_STREAM).await.map(|hub| hub.cached_info().config.clone());
            let config = known.unwrap_or(Config { name: HUB_STREAM.into(), ..config });
            let config = Config { sources: Some(leaves.iter().map(of_leaf).collect()), ..config };
            server.context.create_or_update_stream(config).await?;
            Ok(server.context.get_stream(HUB_STREAM).await?)
        });
        let stream = stream.with_context(|| refused(&server.name))?;
        Ok(Self { server, stream })
    }

    /// Has the server forget what is older, collected or not; without this it keeps everything.
    ///
    /// # Errors
    /// If the server refuses it.
    pub fn keep_for(&self, time: Duration) -> Result<()> {
        let name = &self.stream.cached_info().config.name;
        let kept = self.server.wait(async {
            let config = self.server.context.get_stream(name).await?.cached_info().config.clone();
            self.server.context.update_stream(Config { max_age: time, ..config }).await?;
            anyhow::Ok(())
        });
        kept.with_context(|| self.server.name.clone())
    }

    /// Has the stream of this server take what a gateway publishes of a bus, and only that: what passes by on its way between
    /// servers that are joined is the stream of another.
    fn take_from(&self, bus: &str) -> Result<()> {
        let subject = format!("{bus}.>");
        let taken = self.server.wait(async {
            loop {
                let mut config = self.server.context.get_stream(STREAM).await?.cached_info().config.clone();
                if config.subjects.contains(&subject) {
                    return anyhow::Ok(());
                }
                // seen to have come of it the next time round: another gateway may do the same at this moment
                config.subjects.push(subject.clone());
                self.server.context.update_stream(config).await?;
            }
        });
        taken.with_context(|| self.server.name.clone())
    }

    /// A durable consumer of all items: what one process takes under a `name`, another under it does not get.
    ///
    /// # Errors
    /// If the server refuses it.
    pub fn consumer(&self, name: &str) -> Result<PullConsumer> {
        let config = pull::Config {
            durable_name: Some(name.into()),
            ack_policy: AckPolicy::Explicit,
            ack_wait: ACKNOWLEDGED_WITHIN,
            max_ack_pending: MOST_PENDING,
            ..pull::Config::default()
        };
        self.server
            .wait(self.stream.get_or_create_consumer(name, config))
            .with_context(|| format!("{}: consumer {name}", self.server.name))
    }

    /// Items that come within a time, at most so many; `take` has kept them when it returns, and then they are acknowledged.
    /// Messages that are no items are set aside and counted.
    ///
    /// # Errors
    /// If the server is gone, or those of `take`.
    pub fn next(
        &self,
        consumer: &PullConsumer,
        most: usize,
        within: Duration,
        take: impl FnOnce(&[Item]) -> Result<()>,
    ) -> Result<Taken> {
        let messages = self
            .server
            .wait(gathered(consumer, most, within))
            .map_err(|error| anyhow!("{}: {error}", self.server.name))?;
        let (mut items, mut strange) = (Vec::with_capacity(messages.len()), Vec::new());
        let mut known = Vec::with_capacity(messages.len());
        for message in &messages {
            match item_of(&message.payload) {
                Ok(item) => {
                    items.push(item);
                    known.push(message);
                }
                Err(why) => strange.push((message, why)),
            }
        }
        take(&items)?;
        self.server
            .wait(async {
                for message in known {
                    message.ack().await?;
                }
                for (message, _) in &strange {
                    message.ack_with(AckKind::Term).await?;
                }
                Ok(self.server.client.flush().await?)
            })
            .map_err(|error: async_nats::Error| anyhow!("{}: {error}", self.server.name))?;
        let strange = strange.into_iter().map(|(_, why)| why).collect();
        Ok(Taken { items: items.len(), strange })
    }
}

/// Messages that come within a time, at most so many. One fetch ends with what is there at once, and many small groups cost a
/// store far more than a few.
async fn gathered(
    consumer: &PullConsumer,
    most: usize,
    within: Duration,
) -> Result<Vec<jetstream::Message>, async_nats::Error> {
    let until = Instant::now() + within;
    let mut all: Vec<jetstream::Message> = Vec::new();
    while all.len() < most {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            break;
        }
        let mut some =
            consumer.fetch().max_messages(most - all.len()).expires(left.max(BETWEEN)).messages().await?;
        // a server that does not say that this was all would be waited for, for seconds
        let wait = || until.saturating_duration_since(Instant::now()) + BETWEEN;
        while let Ok(Some(message)) = tokio::time::timeout(wait(), some.next()).await {
            all.push(message?);
        }
        tokio::time::sleep(BETWEEN.min(left)).await;
    }
    Ok(all)
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Taken {
    pub items: usize,
    /// Why other messages are none, each a sentence.
    pub strange: Vec<String>,
}

fn item_of(payload: &[u8]) -> Result<Item, String> {
    #[derive(serde::Deserialize)]
    struct Versioned {
        schema: u32,
    }
    let versioned: Versioned =
        serde_json::from_slice(payload).map_err(|e| format!("a message that is no item ({e})"))?;
    if versioned.schema > SCHEMA {
        let newer = versioned.schema;
        return Err(format!("an item of version {newer}, this program knows {SCHEMA}; update it"));
    }
    serde_json::from_slice(payload).map_err(|e| format!("a message that is no item ({e})"))
}

fn subject(item: &Item) -> String {
    let source = &item.source;
    format!("{}.{}.{}", bus_subject(&source.plant, &source.bus), source.node, item.body.kind().name())
}

fn bus_subject(plant: &str, bus: &str) -> String {
    format!("rotor_edge.{}.{}", plain_word(plant), plain_word(bus))
}

impl Sink for Stream {
    fn claim(&mut self, plant: &str, bus: &str) -> Result<()> {
        claim::claim(&self.server, plant, bus)?;
        self.take_from(&bus_subject(plant, bus))
    }

    fn last(&mut self, plant: &str, bus: &str) -> Result<Vec<(u8, Kind, Last)>> {
        let of_bus = format!("{}.>", bus_subject(plant, bus));
        let found = self.server.wait(async {
            let subjects: Vec<(String, usize)> =
                self.stream.info_with_subjects(of_bus).await?.try_collect().await?;
            let mut all = Vec::new();
            for (subject, _) in subjects {
                let message = self.stream.get_last_raw_message_by_subject(&subject).await?;
                let item = item_of(&message.payload).map_err(|why| anyhow!("{subject}: {why}"))?;
                let last = Last { epoch: item.epoch, sequence: item.sequence, time_us: item.time_us };
                all.push((item.source.node, item.body.kind(), last));
            }
            anyhow::Ok(all)
        });
        found.with_context(|| self.server.name.clone())
    }

    fn put(&mut self, items: &[Item]) -> Result<()> {
        let sent = self.server.wait(async {
            let mut answers = Vec::with_capacity(items.len());
            for item in items {
                let message =
                    PublishMessage::build().payload(serde_json::to_vec(item)?.into()).message_id(item.id());
                answers.push(self.server.context.send_publish(subject(item), message).await?.into_future());
            }
            future::try_join_all(answers).await?;
            anyhow::Ok(())
        });
        sent.with_context(|| self.server.name.clone())
    }

    fn description(&self) -> String {
        self.server.name.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newer_items_and_other_messages_are_told_from_each_other() {
        assert!(item_of(br#"{"schema": 9}"#).unwrap_err().contains("version 9"));
        assert!(item_of(b"hello").unwrap_err().contains("no item"));
        assert!(item_of(br#"{"schema": 1}"#).unwrap_err().contains("no item"));
    }
}
