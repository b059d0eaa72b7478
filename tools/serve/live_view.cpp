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

#include "pipeline/overtake.h"

namespace overtake::serve {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr const char* kProtocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};
constexpr std::chrono::milliseconds kStalled(100), kLeft(200);
constexpr std::size_t kMostAnswers = 64;  // that wait for a client which asks and does not read

std::string encode_base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kDigits[word >> (18 - 6 * k) & 63];
  }
  return out;
}

SocketMessage text_message(const Json& json) {
  return {true, json.dump(-1, ' ', false, Json::error_handler_t::replace), nullptr};
}

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
          {"schema", binary ? encode_base64(channel.schema_data) : channel.schema_data},
          {"schemaEncoding", channel.schema_encoding}};
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
      for (; frame_ && next_ < frame_->size(); ++next_) {
        const auto subscribed = subscriptions_.find((*frame_)[next_].channel);
        if (subscribed == subscriptions_.end()) continue;
        out = data_message(subscribed->second, (*frame_)[next_++]);
        return true;
      }
      if (frame_) ++state_->counts.sent;
      frame_ = std::move(slot_);
      slot_.reset();
      next_ = 0;
      if (!frame_) return false;
      if (dropped_ == told_) continue;
      told_ = dropped_;
      out = status_message(1, "frames",
                           std::to_string(dropped_) + " of " + std::to_string(frames_) +
                               " frames were not sent: this client is slower than the run");
      return true;
    }
  }

  bool receive(std::string_view data, bool text) override {
    const std::lock_guard lock(state_->mutex);
    if (answers_.size() >= kMostAnswers) return false;
    try {
      if (!text) throw std::runtime_error("binary messages are not expected");
      const Json json = Json::parse(data);
      const std::string op = json.at("op");
      if (op == "subscribe")
        for (const Json& wish : json.at("subscriptions")) subscribe(wish.at("id"), wish.at("channelId"));
      else if (op == "unsubscribe")
        for (const Json& id : json.at("subscriptionIds")) unsubscribe(id);
    } catch (const std::exception& error) {
      answers_.push_back(status_message(2, "request", std::string("a request was not understood: ") + error.what()));
    }
    return true;
  }

  bool has(uint16_t channel) const { return subscriptions_.contains(channel); }
  bool wants(const cli::ViewChannel& channel) const {
    return has(channel.id) && (channel.once ? !had_.contains(channel.id) : !is_stalled());
  }
  void give_once(const FrameMessage& message) {
    if (!has(message.channel) || !had_.insert(message.channel).second) return;
    answers_.push_back(data_message(subscriptions_.at(message.channel), message));
    wake_();
  }
  void give(const std::shared_ptr<const LiveFrame>& frame) {
    if (subscriptions_.empty()) return;
    ++frames_;
    if (slot_) ++dropped_, ++state_->counts.dropped;
    if (frame->empty()) return;
    slot_ = frame;
    wake_();
  }
  bool has_all() const { return answers_.empty() && !slot_ && !frame_ && advertised_ == state_->channels.size(); }
  bool left_for(Clock::duration time) const { return Clock::now() - progress_ > time; }
  void wake() const { wake_(); }

 private:
  bool is_stalled() const { return slot_ && left_for(kStalled); }
  void subscribe(uint32_t id, uint32_t channel) {
    if (channel == 0 || channel > state_->channels.size())
      throw std::runtime_error("there is no channel " + std::to_string(channel));
    subscriptions_[uint16_t(channel)] = id;
  }
  void unsubscribe(uint32_t id) {
    std::erase_if(subscriptions_, [id](const auto& entry) { return entry.second == id; });
  }

  const std::function<void()> wake_;
  const std::shared_ptr<State> state_;
  std::map<uint16_t, uint32_t> subscriptions_;  // channel: the client's id
  std::set<uint16_t> had_;                      // channels of one message
  std::deque<SocketMessage> answers_;
  std::size_t advertised_ = 0;                     // channels
  std::shared_ptr<const LiveFrame> frame_, slot_;  // being sent; the one after it
  std::size_t next_ = 0;                           // message of frame_
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
  return std::any_of(state_->clients.begin(), state_->clients.end(),
                     [&](const Client* client) { return client->wants(wanted); });
}

void LiveView::write(uint16_t channel, int64_t stamp_ns, std::string_view data) {
  FrameMessage message{channel, stamp_ns, std::make_shared<const std::string>(data)};
  const std::lock_guard lock(state_->mutex);
  if (!state_->channels[std::size_t(channel - 1)].once) return state_->pending.push_back(std::move(message));
  for (Client* client : state_->clients) client->give_once(message);
}

void LiveView::end_frame() {
  const std::lock_guard lock(state_->mutex);
  const auto frame = std::make_shared<const LiveFrame>(std::move(state_->pending));
  state_->pending.clear();
  for (Client* client : state_->clients) client->give(frame);
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
