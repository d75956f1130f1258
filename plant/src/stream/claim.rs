//! One gateway a bus, over all servers that are joined: who keeps a bus answers whoever else would.

use std::time::Duration;

use anyhow::{Result, bail};
use futures_util::StreamExt as _;
use jiff::Timestamp;

use super::server::Server;
use crate::item::plain_word;
use crate::sink::is_kept;

/// How long another gateway may take to answer.
const ANSWERED_WITHIN: Duration = Duration::from_millis(500);

/// Keeps a bus as long as the connection lives.
///
/// # Errors
/// One sentence if another gateway does, or if the server carries nothing about this bus for us.
pub fn claim(server: &Server, plant: &str, bus: &str) -> Result<()> {
    let subject = format!("rotor_edge_gateway.{}.{}", plain_word(plant), plain_word(bus));
    // of two that begin at once the earlier stays
    let me = format!("{:020}-{}", Timestamp::now().as_nanosecond(), std::process::id());
    let earliest = server.wait(async {
        let mut asked = server.client.subscribe(subject.clone()).await?;
        let (client, mine) = (server.client.clone(), me.clone());
        server.spawn(async move {
            while let Some(message) = asked.next().await {
                if let Some(asker) = message.reply {
                    // one that is not answered asks in vain, and is told by what it hears from others
                    let _ = client.publish(asker, mine.clone().into()).await;
                }
            }
        });
        let inbox = server.client.new_inbox();
        let mut answers = server.client.subscribe(inbox.clone()).await?;
        server.client.publish_with_reply(subject, inbox, "".into()).await?;
        server.client.flush().await?;
        let mut earliest: Option<String> = None;
        let listening = async {
            while let Some(answer) = answers.next().await {
                let other = String::from_utf8_lossy(&answer.payload).into_owned();
                earliest = Some(earliest.take().map_or(other.clone(), |earliest| earliest.min(other)));
            }
        };
        // it ends by its time: who answers last is not known
        let _ = tokio::time::timeout(ANSWERED_WITHIN, listening).await;
        anyhow::Ok(earliest)
    })?;
    // its own answer comes back to it, unless the server carries neither
    let Some(earliest) = earliest else {
        bail!(
            "{}: lets nobody with these credentials speak for bus {bus} of {plant}; see its permissions",
            server.name
        );
    };
    if earliest < me {
        bail!(is_kept(&server.name, plant, bus));
    }
    Ok(())
}
