// SPDX-License-Identifier: MIT
#include "report/live_page.hpp"

#include <arpa/inet.h>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>

#include "report/explore.hpp"
#include "report/parts.hpp"
#include "util/error.hpp"

namespace rim::report {

namespace {

constexpr std::size_t kMostRequest = 8192;
constexpr std::chrono::milliseconds kWait{200}, kWaitSending{1000};

constexpr const char *kProgram =
#include "live_js.inc"
    ;

[[noreturn]] void fail(std::uint16_t port, const char *what) {
  throw DataError(fmt::format("--html: 127.0.0.1:{}: {}: {}", port, what, std::strerror(errno)));
}

std::string reply(const char *status, const char *type, const std::string &body) {
  return fmt::format("HTTP/1.1 {}\r\nContent-Type: {}; charset=utf-8\r\nContent-Length: {}\r\n"
                     "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n"
                     "Connection: close\r\n\r\n",
                     status, type, body.size()) +
         body;
}

// A header's value, without regard to the case of its name; empty: not there.
std::string header(const std::string &request, const std::string &name) {
  for (std::size_t at = request.find("\r\n"); at != std::string::npos;
       at = request.find("\r\n", at + 2)) {
    const std::size_t begin = at + 2;
    if (::strncasecmp(request.c_str() + begin, name.c_str(), name.size()) == 0 &&
        request[begin + name.size()] == ':') {
      const std::size_t value = request.find_first_not_of(' ', begin + name.size() + 1);
      return value == std::string::npos
                 ? ""
                 : request.substr(value, request.find("\r\n", value) - value);
    }
  }
  return "";
}

// Whether a socket becomes ready before the time that it has is over.
bool is_ready(int client, short event, std::chrono::steady_clock::time_point until) {
  using std::chrono::milliseconds;
  const auto left =
      std::chrono::duration_cast<milliseconds>(until - std::chrono::steady_clock::now());
  pollfd ready{client, event, 0};
  return left.count() > 0 && ::poll(&ready, 1, static_cast<int>(left.count())) > 0;
}

} // namespace

LivePage::LivePage(std::uint16_t port) : port_(port) {
  socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0)
    fail(port, "no socket");
  const int on = 1;
  ::setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t bytes = sizeof address;
  auto *name = reinterpret_cast<sockaddr *>(&address);
  if (::bind(socket_, name, bytes) != 0 || ::listen(socket_, 8) != 0 ||
      ::getsockname(socket_, name, &bytes) != 0) {
    const int error = errno;
    ::close(socket_);
    errno = error;
    fail(port, "cannot serve");
  }
  port_ = ntohs(address.sin_port);
}

LivePage::~LivePage() { ::close(socket_); }

std::string LivePage::url() const { return fmt::format("http://127.0.0.1:{}/", port_); }

void LivePage::serve() {
  for (int client; (client = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC)) >= 0;) {
    answer(client);
    ::close(client);
  }
}

void LivePage::answer(int client) const {
  std::string request;
  char buffer[2048];
  auto until = std::chrono::steady_clock::now() + kWait; // however slowly it comes
  while (request.find("\r\n\r\n") == std::string::npos && request.size() < kMostRequest) {
    if (!is_ready(client, POLLIN, until))
      return;
    const ssize_t n = ::recv(client, buffer, sizeof buffer, MSG_DONTWAIT);
    if (n <= 0)
      return;
    request.append(buffer, static_cast<std::size_t>(n));
  }
  const std::string text = response_to(request);
  until = std::chrono::steady_clock::now() + kWaitSending;
  for (std::size_t sent = 0; sent < text.size();) {
    if (!is_ready(client, POLLOUT, until))
      return;
    const ssize_t n =
        ::send(client, text.data() + sent, text.size() - sent, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n <= 0)
      return;
    sent += static_cast<std::size_t>(n);
  }
}

std::string LivePage::response_to(const std::string &request) const {
  const std::string host = header(request, "Host");
  if (host != fmt::format("127.0.0.1:{}", port_) && host != fmt::format("localhost:{}", port_))
    return reply("403 Forbidden", "text/plain", "another host\n");
  if (request.rfind("GET ", 0) != 0)
    return reply("405 Method Not Allowed", "text/plain", "GET only\n");
  const std::string target = request.substr(4, request.find(' ', 4) - 4);
  if (target == "/")
    return reply("200 OK", "text/html", page());
  const std::string records = "/records?from=";
  if (target.rfind(records, 0) != 0)
    return reply("404 Not Found", "text/plain", "no such page\n");
  std::string body = "[";
  for (std::size_t i = std::strtoul(target.c_str() + records.size(), nullptr, 10);
       i < records_.size(); ++i)
    body += (body.size() > 1 ? ",\n" : "") + records_[i];
  return reply("200 OK", "application/json", body + "]\n");
}

std::string LivePage::page() const {
  const Library library = dygraphs();
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
         "<link rel=\"icon\" href=\"data:,\">\n<title>rim listen</title>\n<style>\n" +
         diagnose::report::style_sheet() + library.style +
         "#plot{width:100%;height:240px}#plot-legend{min-height:1.6em;font-size:13px}"
         ".dygraph-axis-label,.dygraph-label{color:var(--ink2);font-size:12px}"
         "td:not(:last-child){white-space:nowrap;vertical-align:top}</style>\n</"
         "head>\n<body>\n<main>\n<header>\n"
         "<p class=\"top\"><span>rim listen</span><span id=\"link\">waiting</span>"
         "<span id=\"count\">0 records</span><span id=\"standing\">no alarm yet</span></p>\n"
         "<p class=\"lead\" id=\"sentence\"></p>\n<p id=\"entry\"></p>\n"
         "<p class=\"note\" id=\"health\"></p>\n</header>\n<section>\n"
         "<h2>Evidence, by record</h2>\n<div id=\"plot-legend\"></div><div "
         "id=\"plot\"></div>\n</section>\n<section>\n"
         "<h2>Records, the newest first</h2>\n<div class=\"scroll\"><table><thead><tr><th>t, s</th>"
         "<th>state</th><th>level</th><th>kind</th><th>what</th></tr></thead>"
         "<tbody id=\"records\"></tbody></table></div>\n</section>\n</main>\n<noscript><p>This "
         "page "
         "needs scripts: rim listen prints the same lines.</p></noscript>\n<script>" +
         library.script + "</script>\n<script>" + kProgram + "</script>\n</body>\n</html>\n";
}

} // namespace rim::report
