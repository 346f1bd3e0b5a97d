/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "transport/lcm_udp.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "transport/lcm_packet.h"

#define RECEIVE_BUFFER (1 << 20) /* bytes asked of the kernel: a second of many observations */

static void count(uint32_t *counter) {
  if (*counter != UINT32_MAX)
    ++*counter;
}

/* A number from 0 to most, the whole of text up to `end`. */
static bool parse_number(const char *text, const char *end, unsigned long most,
                         unsigned long *value) {
  unsigned long sum = 0;
  if (text == end)
    return false;
  for (; text < end; ++text) {
    if (*text < '0' || *text > '9')
      return false;
    sum = 10 * sum + (unsigned long)(*text - '0');
    if (sum > most)
      return false;
  }
  *value = sum;
  return true;
}

const char *lcm_udp_parse(lcm_udp_address *address, const char *url) {
  static const char scheme[] = "udpm://", option[] = "ttl=";
  char host[INET_ADDRSTRLEN];
  struct in_addr group;
  unsigned long port, ttl = 0;
  if (strncmp(url, scheme, sizeof scheme - 1) != 0)
    return "must begin with udpm://";
  url += sizeof scheme - 1;
  const char *colon = strchr(url, ':');
  if (colon == NULL || (size_t)(colon - url) >= sizeof host)
    return "must be udpm://GROUP:PORT?ttl=N";
  memcpy(host, url, (size_t)(colon - url));
  host[colon - url] = '\0';
  if (inet_pton(AF_INET, host, &group) != 1 || !IN_MULTICAST(ntohl(group.s_addr)))
    return "the group must be an IPv4 multicast address, 224.0.0.0 to 239.255.255.255";
  const char *end = colon + 1 + strcspn(colon + 1, "?");
  if (!parse_number(colon + 1, end, 65535, &port) || port == 0)
    return "the port must be 1 to 65535";
  if (*end == '?') {
    if (strncmp(end + 1, option, sizeof option - 1) != 0)
      return "the only option is ttl=N";
    const char *number = end + sizeof option;
    if (!parse_number(number, number + strlen(number), 255, &ttl))
      return "ttl must be 0 to 255";
  }
  *address =
      (lcm_udp_address){.group = ntohl(group.s_addr), .port = (uint16_t)port, .ttl = (uint8_t)ttl};
  return NULL;
}

static int set(int fd, int level, int name, const void *value, socklen_t bytes) {
  return setsockopt(fd, level, name, value, bytes) == 0 ? 0 : -errno;
}

/* The socket, or a negative errno. */
static int open_sender(const lcm_udp_address *address, const char **what) {
  *what = "socket";
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0)
    return -errno;
  const unsigned char ttl = address->ttl, loop = 1;
  const struct ip_mreqn interface = {.imr_address.s_addr = htonl(address->interface)};
  *what = "time to live";
  int status = set(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  if (status == 0)
    status = set(fd, IPPROTO_IP, IP_MULTICAST_LOOP, &loop, sizeof loop);
  if (status == 0 && address->interface != 0) {
    *what = "sending interface";
    status = set(fd, IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface);
  }
  if (status == 0)
    return fd;
  close(fd);
  return status;
}

static int open_receiver(const lcm_udp_address *address, const char **what) {
  *what = "socket";
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0)
    return -errno;
  const int yes = 1, no = 0, bytes = RECEIVE_BUFFER;
  const struct sockaddr_in name = {.sin_family = AF_INET,
                                   .sin_port = htons(address->port),
                                   .sin_addr.s_addr = htonl(address->group)};
  const struct ip_mreqn membership = {.imr_multiaddr.s_addr = htonl(address->group),
                                      .imr_address.s_addr = htonl(address->interface)};
  (void)set(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes); /* less also works */
  (void)set(fd, SOL_SOCKET, SO_RXQ_OVFL, &yes, sizeof yes);
  /* Else Linux also hands out what another program's membership brings in by other interfaces. */
  *what = "own memberships alone";
  int status = set(fd, IPPROTO_IP, IP_MULTICAST_ALL, &no, sizeof no);
  *what = status == 0 ? "sharing the port" : *what;
  if (status == 0)
    status = set(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (status == 0)
    status = set(fd, SOL_SOCKET, SO_REUSEPORT, &yes, sizeof yes);
  if (status == 0) {
    *what = "binding to the group";
    status = bind(fd, (const struct sockaddr *)&name, sizeof name) == 0 ? 0 : -errno;
  }
  if (status == 0) {
    *what = "joining the group (is there a multicast route? ip route add 224.0.0.0/4 dev lo)";
    status = set(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership);
  }
  if (status == 0)
    return fd;
  close(fd);
  return status;
}

int lcm_udp_open(lcm_udp *lcm, const lcm_udp_address *address, bool receive, const char **what) {
  lcm->in = lcm->out = -1;
  lcm->address = *address;
  lcm->sequence = lcm->overflow = 0;
  memset(&lcm->counts, 0, sizeof lcm->counts);
  memset(&lcm->fragments, 0, sizeof lcm->fragments);
  lcm->out = open_sender(address, what);
  if (lcm->out < 0)
    return lcm->out;
  if (!receive)
    return 0;
  lcm->in = open_receiver(address, what);
  if (lcm->in >= 0)
    return 0;
  const int status = lcm->in;
  lcm->in = -1;
  lcm_udp_close(lcm);
  return status;
}

void lcm_udp_close(lcm_udp *lcm) {
  if (lcm->in >= 0)
    close(lcm->in);
  if (lcm->out >= 0)
    close(lcm->out);
  lcm->in = lcm->out = -1;
}

int lcm_udp_send(lcm_udp *lcm, const char *channel, const uint8_t *payload, size_t bytes) {
  uint8_t header[LCM_PACKET_HEADER_BYTES];
  const size_t before = lcm_packet_header(header, channel, lcm->sequence);
  if (before == 0)
    return -EINVAL;
  struct sockaddr_in to = {.sin_family = AF_INET,
                           .sin_port = htons(lcm->address.port),
                           .sin_addr.s_addr = htonl(lcm->address.group)};
  struct iovec part[2] = {{header, before}, {(void *)(uintptr_t)payload, bytes}};
  const struct msghdr message = {
      .msg_name = &to, .msg_namelen = sizeof to, .msg_iov = part, .msg_iovlen = 2};
  if (sendmsg(lcm->out, &message, MSG_DONTWAIT | MSG_NOSIGNAL) >= 0) {
    lcm->sequence++;
    return 0;
  }
  const int status = -errno;
  if (status != -EAGAIN && status != -ENOBUFS)
    count(&lcm->counts.unsent);
  return status;
}

/* The kernel tells with every datagram how many it has dropped so far. */
static void note_overflow(lcm_udp *lcm, struct msghdr *message) {
  for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c != NULL; c = CMSG_NXTHDR(message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL)
      continue;
    uint32_t total;
    memcpy(&total, CMSG_DATA(c), sizeof total);
    const uint32_t more = total - lcm->overflow;
    lcm->overflow = total;
    lcm->counts.lost = more > UINT32_MAX - lcm->counts.lost ? UINT32_MAX : lcm->counts.lost + more;
  }
}

/* 1: with this fragment a message is whole. */
static int take_fragment(lcm_udp *lcm, const struct sockaddr_in *from, size_t bytes,
                         lcm_udp_message *message) {
  const uint64_t sender = (uint64_t)from->sin_addr.s_addr << 16 | from->sin_port;
  const lcm_fragments_answer answer =
      lcm_fragments_take(&lcm->fragments, sender, lcm->buffer, bytes, &message->channel,
                         &message->payload, &message->bytes, &lcm->counts.fragments);
  if (answer == LCM_FRAGMENTS_REFUSED)
    count(&lcm->counts.fragments);
  return answer == LCM_FRAGMENTS_COMPLETE ? 1 : -1;
}

int lcm_udp_receive(lcm_udp *lcm, lcm_udp_message *message) {
  _Alignas(struct cmsghdr) char control[64];
  struct sockaddr_in from = {0};
  struct iovec part = {lcm->buffer, sizeof lcm->buffer};
  struct msghdr received = {.msg_name = &from,
                            .msg_namelen = sizeof from,
                            .msg_iov = &part,
                            .msg_iovlen = 1,
                            .msg_control = control,
                            .msg_controllen = sizeof control};
  const ssize_t bytes = recvmsg(lcm->in, &received, MSG_DONTWAIT);
  if (bytes < 0)
    return errno == EAGAIN || errno == EWOULDBLOCK ? 0 : -1;
  note_overflow(lcm, &received);
  const lcm_packet_kind kind = (received.msg_flags & MSG_TRUNC) != 0
                                   ? LCM_PACKET_MALFORMED
                                   : lcm_packet_open(lcm->buffer, (size_t)bytes, &message->channel,
                                                     &message->payload, &message->bytes);
  if (kind == LCM_PACKET_MESSAGE)
    return 1;
  if (kind == LCM_PACKET_FRAGMENT)
    return take_fragment(lcm, &from, (size_t)bytes, message);
  count(&lcm->counts.malformed);
  return -1;
}
