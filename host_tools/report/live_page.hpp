// SPDX-License-Identifier: MIT
// report/live_page.hpp - what is heard, as a page for a browser on the same machine.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rim::report {

// Serves one page on 127.0.0.1 and the records that it asks for. Requests that name another host
// (a page from elsewhere, by DNS rebinding) and other methods than GET are refused. serve() is
// called from the loop that hears; nothing runs beside it.
class LivePage {
public:
  // port 0: a free one. DataError: the port cannot be had.
  explicit LivePage(std::uint16_t port);
  ~LivePage();
  LivePage(const LivePage &) = delete;
  LivePage &operator=(const LivePage &) = delete;

  std::string url() const; // "http://127.0.0.1:8123/"
  void add(const std::string &json) { records_.push_back(json); }
  // Answers what has come. Waits at most 0.2 s for a request that has begun, and 1 s for its answer
  // to be taken.
  void serve();

private:
  void answer(int client) const;
  std::string response_to(const std::string &request) const;
  std::string page() const;

  int socket_ = -1;
  std::uint16_t port_ = 0;
  std::vector<std::string> records_;
};

} // namespace rim::report
