// SPDX-License-Identifier: MIT
// The page of `rim listen --html`: what is asked in an odd way neither ends nor holds up the loop
// that hears alarms.
#include "check.hpp"
#include "report/live_page.hpp"

#include <arpa/inet.h>
#include <atomic>
#include <chrono>
#include <netinet/in.h>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

namespace {

using Clock = std::chrono::steady_clock;

// A connection to the page; what is sent waits there until it is served.
class Browser {
public:
  explicit Browser(const rim::report::LivePage &page) {
    const std::string url = page.url();
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port =
        htons(static_cast<std::uint16_t>(std::stoul(url.substr(url.rfind(':') + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_int_equal(
        ::connect(socket_, reinterpret_cast<const sockaddr *>(&address), sizeof address), 0);
  }
  ~Browser() { ::close(socket_); }
  Browser(const Browser &) = delete;
  Browser &operator=(const Browser &) = delete;

  void send(const std::string &text) const {
    (void)::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
  }
  std::string answer() const {
    char begin[16] = {};
    const ssize_t n = ::recv(socket_, begin, sizeof begin - 1, 0);
    return n > 0 ? std::string(begin, static_cast<std::size_t>(n)) : "";
  }

private:
  int socket_;
};

std::string host_of(const rim::report::LivePage &page) {
  const std::string url = page.url();
  return url.substr(7, url.size() - 8);
}

void odd_requests_are_refused(void **) {
  rim::report::LivePage page(0);
  for (const std::string &request :
       {"GET / HTTP/1.1\r\nHost:" + std::string(9000, ' '), std::string("\r\n\r\n"),
        "GET / HTTP/1.1\r\nHost:\r\n\r\n" + std::string(100, 'x'),
        "GET / HTTP/1.1" + std::string(9000, 'x'), std::string("GET\r\nHost\r\n\r\n")}) {
    Browser browser(page);
    browser.send(request);
    page.serve();
    const std::string answer = browser.answer();
    assert_true(answer.empty() || answer.rfind("HTTP/1.1 403", 0) == 0);
  }
  Browser browser(page);
  browser.send("GET /records?from=0 HTTP/1.1\r\nhost:  " + host_of(page) + "\r\n\r\n");
  page.serve();
  assert_true(browser.answer().rfind("HTTP/1.1 200", 0) == 0);
}

// A letter now and then would have kept the loop for as long as it likes.
void a_slow_request_is_given_up(void **) {
  rim::report::LivePage page(0);
  Browser browser(page);
  browser.send("GET ");
  std::atomic<bool> over{false};
  std::thread slow([&] {
    for (int i = 0; i < 50 && !over; ++i) {
      browser.send("/");
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
  const auto begin = Clock::now();
  page.serve();
  const double taken_s = std::chrono::duration<double>(Clock::now() - begin).count();
  over = true;
  slow.join();
  assert_true(taken_s < 1.0); // 0.2 s, and a busy machine
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {cmocka_unit_test(odd_requests_are_refused),
                                     cmocka_unit_test(a_slow_request_is_given_up)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
