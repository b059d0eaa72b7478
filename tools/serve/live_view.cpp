// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/serve/live_view.h"

#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>
#include <utility>

#include "pipeline/overtake.h"
#include "tools/io/base64.h"
#include "tools/io/json_text.h"

namespace overtake::serve {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr const char* kProtocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};
constexpr std::chrono::milliseconds kStalled(100), kLeft(200);
constexpr std::size_t kMostAnswers = 64;  // that wait for a client which asks and does not read

SocketMessage text_message(const Json& json) { return {true, io::dump_json(json), nullptr}; }

// level: 0 information, 1 warning, 2 error. A status replaces the one of its id.
SocketMessage status_message(int32_t level, const char* id, const std::string& text) {
  return text_message({{"op", "status"}, {"level", level}, {"id", id}, {"message", text}});
}

Json describe(const cli::ViewChannel& channel) {
  const bool binary = channel.schema_encoding == "protobuf";
  return {{"id", channel.id},
          {"topic", channel.topic},
          {"encoding", channel.encoding},
          {"schemaName", channel.schema},
          {"schema", binary ? io::encode_base64(channel.schema_data) : channel.schema_data},
          {"schemaEncoding", channel.schema_encoding}};
}

// A client's request. A mistake in it is a sentence, and the rest of the request is not followed.
struct LiveRequest {
  struct Wish {
    uint32_t id = 0, channel = 0;
  };
  std::vector<Wish> subscribe;
  std::vector<uint32_t> unsubscribe;
  std::string mistake;
};

uint32_t id_of(const Json& json) {
  if (!json.is_number_unsigned() || json.get<uint64_t>() > UINT32_MAX)
    throw std::runtime_error(std::string("an id is a whole number from 0 to 4294967295, not of type ") +
                             json.type_name());
  return json.get<uint32_t>();
}

LiveRequest parse_request(std::string_view data, bool text) {
  LiveRequest request;
  try {
    if (!text) throw std::runtime_error("binary messages are not expected");
    const Json json = Json::parse(data);
    const std::string op = json.at("op");
    if (op == "subscribe")
      for (const Json& wish : json.at("subscriptions"))
        request.subscribe.push_back({id_of(wish.at("id")), id_of(wish.at("channelId"))});
    else if (op == "unsubscribe")
      for (const Json& id : json.at("subscriptionIds")) request.unsubscribe.push_back(id_of(id));
  } catch (const std::exception& error) {
    request.mistake = error.what();
  }
  return request;
}

struct FrameMessage {
  uint16_t channel;
  int64_t stamp_ns;
  std::shared_ptr<const std::string> data;
};
using LiveFrame = std::vector<FrameMessage>;

SocketMessage data_message(uint32_t subscription, const FrameMessage& message) {
  constexpr uint8_t kMessageData = 1;
  SocketMessage out{false, std::string(13, '\0'), message.data};
  out.head[0] = char(kMessageData);
  const auto stamp = uint64_t(message.stamp_ns);
  std::memcpy(out.head.data() + 1, &subscription, sizeof subscription);  // little-endian, as every machine we run on
  std::memcpy(out.head.data() + 5, &stamp, sizeof stamp);
  return out;
}

}  // namespace

struct LiveView::State {
  mutable std::mutex mutex;  // held for short copies alone
  std::vector<cli::ViewChannel> channels;
  std::set<Client*> clients;
  LiveFrame pending;
  bool in_frame = false;
  std::set<uint16_t> wanted;  // of the frame that is being written: what clients asked for before it began
  Counts counts;
  std::string session;
};

// State's mutex guards every member.
class LiveView::Client : public SocketClient {
 public:
  Client(std::shared_ptr<State> state, std::function<void()> wake) : wake_(std::move(wake)), state_(std::move(state)) {
    const std::lock_guard lock(state_->mutex);
    state_->clients.insert(this);
    ++state_->counts.clients;
    ovt_build_info build;
    ovt_read_build_info(&build);
    answers_.push_back(text_message({{"op", "serverInfo"},
                                     {"name", std::string("overtake ") + build.version_text},
                                     {"capabilities", Json::array()},
                                     {"supportedEncodings", Json::array()},
                                     {"metadata", Json::object()},
                                     {"sessionId", state_->session}}));
  }
  ~Client() override {
    const std::lock_guard lock(state_->mutex);
    state_->clients.erase(this);
  }

  bool next(SocketMessage& out) override {
    const std::lock_guard lock(state_->mutex);
    progress_ = Clock::now();
    if (!answers_.empty()) {
      out = std::move(answers_.front());
      answers_.pop_front();
      return true;
    }
    if (advertised_ < state_->channels.size()) {
      Json list = Json::array();
      for (; advertised_ < state_->channels.size(); ++advertised_)
        list.push_back(describe(state_->channels[advertised_]));
      out = text_message({{"op", "advertise"}, {"channels", list}});
      return true;
    }
    while (true) {
      for (; frame_.messages && next_ < frame_.messages->size(); ++next_) {
        const FrameMessage& message = (*frame_.messages)[next_];
        const auto subscribed = subscriptions_.find(message.channel);
        if (subscribed == subscriptions_.end() || !frame_.channels.contains(message.channel)) continue;
        out = data_message(subscribed->second, message);
        ++next_;
        return true;
      }
      if (frame_.messages) ++state_->counts.sent;
      frame_ = std::exchange(slot_, {});
      next_ = 0;
      if (!frame_.messages) return false;
      if (dropped_ == told_) continue;
      told_ = dropped_;
      out = status_message(1, "frames",
                           std::to_string(dropped_) + " of " + std::to_string(frames_) +
                               " frames were not sent: this client is slower than the run");
      return true;
    }
  }

  bool receive(std::string_view data, bool text) override {
    LiveRequest request = parse_request(data, text);  // without the mutex: the run must not wait for it
    const std::lock_guard lock(state_->mutex);
    if (answers_.size() >= kMostAnswers) return false;
    for (const LiveRequest::Wish& wish : request.subscribe)
      if (request.mistake.empty()) request.mistake = subscribe(wish);
    for (const uint32_t id : request.unsubscribe) unsubscribe(id);
    if (!request.mistake.empty())
      answers_.push_back(status_message(2, "request", "a request was not understood: " + request.mistake));
    return true;
  }

  bool has(uint16_t channel) const { return subscriptions_.contains(channel); }
  bool wants(const cli::ViewChannel& channel) const {
    return has(channel.id) && (channel.once ? !had_.contains(channel.id) : !is_stalled());
  }
  // Adds the channels of a frame that this client wants to `wanted`; none while it takes nothing.
  void begin_frame(std::set<uint16_t>& wanted) {
    wished_.clear();
    for (const cli::ViewChannel& channel : state_->channels)
      if (has(channel.id) && !channel.once) wished_.insert(channel.id);
    if (!is_stalled()) wanted.insert(wished_.begin(), wished_.end());
  }
  void give_once(const FrameMessage& message) {
    if (!has(message.channel) || !had_.insert(message.channel).second) return;
    answers_.push_back(data_message(subscriptions_.at(message.channel), message));
    wake_();
  }
  // A client that took nothing at the frame's begin gets it if others wanted all that this client wants.
  void give(const std::shared_ptr<const LiveFrame>& frame, const std::set<uint16_t>& wanted) {
    if (wished_.empty()) return;
    ++frames_;
    const bool is_whole = std::includes(wanted.begin(), wanted.end(), wished_.begin(), wished_.end());
    if (is_whole && frame->empty()) return;
    if (slot_.messages || !is_whole) ++dropped_, ++state_->counts.dropped;
    if (!is_whole) return;
    if (!frame_.messages && !slot_.messages) progress_ = Clock::now();  // nothing was there to take until now
    slot_ = {frame, wished_};
    wake_();
  }
  bool has_all() const {
    return answers_.empty() && !slot_.messages && !frame_.messages && advertised_ == state_->channels.size();
  }
  bool left_for(Clock::duration time) const { return Clock::now() - progress_ > time; }
  void wake() const { wake_(); }

 private:
  struct Slot {
    std::shared_ptr<const LiveFrame> messages;
    std::set<uint16_t> channels;  // that the client wanted at the frame's begin
  };
  bool is_stalled() const { return slot_.messages && left_for(kStalled); }
  // The reason why it cannot be; "": done.
  std::string subscribe(const LiveRequest::Wish& wish) {
    if (wish.channel == 0 || wish.channel > state_->channels.size())
      return "there is no channel " + std::to_string(wish.channel);
    if (!std::exchange(has_subscribed_, true)) ++state_->counts.subscribed;
    subscriptions_[uint16_t(wish.channel)] = wish.id;
    return "";
  }
  void unsubscribe(uint32_t id) {
    for (auto at = subscriptions_.begin(); at != subscriptions_.end();) {
      if (at->second != id) {
        ++at;
        continue;
      }
      had_.erase(at->first);  // who subscribes again gets the map again
      at = subscriptions_.erase(at);
    }
  }

  const std::function<void()> wake_;
  const std::shared_ptr<State> state_;
  std::map<uint16_t, uint32_t> subscriptions_;  // channel: the client's id
  bool has_subscribed_ = false;                 // once
  std::set<uint16_t> had_;                      // channels of one message
  std::deque<SocketMessage> answers_;
  std::size_t advertised_ = 0;  // channels
  std::set<uint16_t> wished_;   // of the frame that is being written
  Slot frame_, slot_;           // being sent; the one after it
  std::size_t next_ = 0;        // message of frame_
  int64_t frames_ = 0, dropped_ = 0, told_ = 0;
  Clock::time_point progress_ = Clock::now();
};

LiveView::LiveView() : state_(std::make_shared<State>()) {
  state_->session = std::to_string(std::chrono::system_clock::now().time_since_epoch().count());
}

LiveView::~LiveView() = default;

void LiveView::add_channel(const cli::ViewChannel& channel) {
  const std::lock_guard lock(state_->mutex);
  state_->channels.push_back(channel);
  for (const Client* client : state_->clients) client->wake();
}

bool LiveView::wants(uint16_t channel) const {
  const std::lock_guard lock(state_->mutex);
  const cli::ViewChannel& wanted = state_->channels[std::size_t(channel - 1)];
  if (state_->in_frame && !wanted.once) return state_->wanted.contains(channel);
  return std::any_of(state_->clients.begin(), state_->clients.end(),
                     [&](const Client* client) { return client->wants(wanted); });
}

void LiveView::write(uint16_t channel, int64_t stamp_ns, std::string_view data) {
  FrameMessage message{channel, stamp_ns, std::make_shared<const std::string>(data)};
  const std::lock_guard lock(state_->mutex);
  if (!state_->channels[std::size_t(channel - 1)].once) return state_->pending.push_back(std::move(message));
  for (Client* client : state_->clients) client->give_once(message);
}

void LiveView::begin_frame() {
  const std::lock_guard lock(state_->mutex);
  state_->in_frame = true;
  state_->wanted.clear();
  for (Client* client : state_->clients) client->begin_frame(state_->wanted);
}

void LiveView::end_frame() {
  const std::lock_guard lock(state_->mutex);
  const auto frame = std::make_shared<const LiveFrame>(std::move(state_->pending));
  state_->pending.clear();
  state_->in_frame = false;
  ++state_->counts.frames;
  for (Client* client : state_->clients) client->give(frame, state_->wanted);
}

LiveView::Counts LiveView::counts() const {
  const std::lock_guard lock(state_->mutex);
  return state_->counts;
}

void LiveView::drain(std::chrono::milliseconds most) const {
  const auto waits = [&] {
    const std::lock_guard lock(state_->mutex);
    return std::any_of(state_->clients.begin(), state_->clients.end(),
                       [](const Client* client) { return !client->has_all() && !client->left_for(kLeft); });
  };
  for (const auto end = Clock::now() + most; Clock::now() < end && waits();)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

std::shared_ptr<SocketClient> LiveView::accept(const std::vector<std::string>& protocols, std::function<void()> wake,
                                               std::string& chosen, Response& refusal) {
  for (const std::string& offered : protocols)
    if (chosen.empty() && std::find(std::begin(kProtocols), std::end(kProtocols), offered) != std::end(kProtocols))
      chosen = offered;
  refusal.status = 400;
  refusal.body = "The subprotocol must be foxglove.sdk.v1 or foxglove.websocket.v1.\n";
  if (chosen.empty()) return nullptr;
  {
    const std::lock_guard lock(state_->mutex);
    refusal.status = 503;
    refusal.body = "There are " + std::to_string(kMostLiveClients) + " clients already.\n";
    if (state_->clients.size() >= kMostLiveClients) return nullptr;
  }
  return std::make_shared<Client>(state_, std::move(wake));
}

}  // namespace overtake::serve
