/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "transport/socketcan.h"

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define RECEIVE_BUFFER                                                                             \
  (4 << 20) /* bytes asked of the kernel: some 4000 frames, a second of a full bus */

_Static_assert(SOCKETCAN_EXTENDED == CAN_EFF_FLAG, "identifiers are the kernel's");
_Static_assert(SOCKETCAN_NAME_BYTES == IFNAMSIZ, "names are the kernel's");

static void count(uint32_t *counter) {
  if (*counter != UINT32_MAX)
    ++*counter;
}

static void note_down(socketcan *can) {
  if (!can->is_down)
    count(&can->counts.down);
  can->is_down = true;
}

static void note_up(socketcan *can) {
  can->is_down = can->is_bus_off = false;
}

/* The interface is gone: a new one of that name is another interface. */
static void let_go(socketcan *can) {
  note_down(can);
  if (can->fd >= 0)
    close(can->fd);
  can->fd = -1;
}

static int set(int fd, int name, const void *value, size_t bytes) {
  return setsockopt(fd, SOL_CAN_RAW, name, value, (socklen_t)bytes) == 0 ? 0 : -errno;
}

static int set_filters(const socketcan *can, int fd) {
  struct can_filter filter[SOCKETCAN_MAX_FILTERS];
  for (size_t i = 0; i < can->filters; ++i) {
    /* CAN_EFF_FLAG in the mask separates 11 and 29 bits, CAN_RTR_FLAG remote requests. */
    filter[i].can_id = can->filter[i].id;
    filter[i].can_mask = can->filter[i].mask | CAN_EFF_FLAG | CAN_RTR_FLAG;
  }
  return set(fd, CAN_RAW_FILTER, can->filters > 0 ? filter : NULL, can->filters * sizeof filter[0]);
}

/* A bound socket, or a negative errno. */
static int open_socket(socketcan *can) {
  const int fd = socket(AF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd < 0)
    return -errno;
  const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_CRTL;
  const int yes = 1, bytes = RECEIVE_BUFFER;
  struct ifreq request;
  memset(&request, 0, sizeof request);
  memcpy(request.ifr_name, can->name, sizeof can->name);
  int status = set_filters(can, fd);
  if (status == 0)
    status = set(fd, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
  if (status == 0 && can->fd_wanted)
    status = set(fd, CAN_RAW_FD_FRAMES, &yes, sizeof yes);
  if (status == 0)
    status = ioctl(fd, SIOCGIFINDEX, &request) == 0 ? 0 : -errno;
  const struct sockaddr_can name = {.can_family = AF_CAN, .can_ifindex = request.ifr_ifindex};
  if (status == 0)
    status = ioctl(fd, SIOCGIFMTU, &request) == 0 ? 0 : -errno;
  can->fd_capable = can->fd_wanted && status == 0 && request.ifr_mtu == CANFD_MTU;
  if (status == 0)
    status = bind(fd, (const struct sockaddr *)&name, sizeof name) == 0 ? 0 : -errno;
  /* Beyond the system's limit where we may (CAP_NET_ADMIN); less also works. */
  if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0)
    (void)setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  can->overflow = 0; /* this socket's own count */
  (void)setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &yes, sizeof yes);
  (void)setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
  if (status == 0 && ioctl(fd, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) == 0)
    note_down(can);
  if (status == 0)
    return fd;
  close(fd);
  return status;
}

int socketcan_open(socketcan *can, const char *name, const socketcan_filter *filter, size_t filters,
                   bool fd) {
  memset(can, 0, sizeof *can);
  can->fd = -1;
  const size_t length = strnlen(name, SOCKETCAN_NAME_BYTES);
  if (length == 0 || length == SOCKETCAN_NAME_BYTES || filters > SOCKETCAN_MAX_FILTERS)
    return -EINVAL;
  memcpy(can->name, name, length);
  if (filters > 0)
    memcpy(can->filter, filter, filters * sizeof filter[0]);
  can->filters = filters;
  can->fd_wanted = fd;
  const int status = open_socket(can);
  if (status >= 0) {
    can->fd = status;
    return 0;
  }
  if (status != -ENODEV)
    return status;
  note_down(can);
  return 0;
}

void socketcan_close(socketcan *can) {
  if (can->fd >= 0)
    close(can->fd);
  can->fd = -1;
}

void socketcan_tend(socketcan *can) {
  if (can->fd >= 0)
    return;
  const int fd = open_socket(can);
  if (fd < 0)
    return;
  can->fd = fd;
  struct ifreq request;
  memset(&request, 0, sizeof request);
  memcpy(request.ifr_name, can->name, sizeof can->name);
  if (ioctl(fd, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0)
    note_up(can);
}

socketcan_sent socketcan_send(socketcan *can, const rim_can_frame *frame) {
  if (can->fd < 0)
    return SOCKETCAN_DOWN;
  if (frame->fd && !can->fd_capable)
    return SOCKETCAN_REFUSED;
  struct canfd_frame out;
  memset(&out, 0, sizeof out);
  out.can_id = frame->id;
  out.len = frame->length;
  out.flags = frame->fd ? CANFD_BRS : 0;
  memcpy(out.data, frame->data, frame->length);
  if (write(can->fd, &out, frame->fd ? CANFD_MTU : CAN_MTU) >= 0) {
    if (!can->is_bus_off) /* off the bus the queue takes frames for a while */
      note_up(can);
    return SOCKETCAN_SENT;
  }
  switch (errno) {
  case ENOBUFS:
  case EAGAIN:
    count(&can->counts.full);
    return SOCKETCAN_FULL;
  case ENETDOWN:
    note_down(can);
    return SOCKETCAN_DOWN;
  case ENODEV:
  case ENXIO:
    let_go(can);
    return SOCKETCAN_DOWN;
  default:
    return SOCKETCAN_REFUSED;
  }
}

static void take_error(socketcan *can, canid_t id) {
  count(&can->counts.errors);
  if ((id & CAN_ERR_BUSOFF) != 0) {
    count(&can->counts.bus_off);
    can->is_bus_off = true;
  }
  if ((id & CAN_ERR_RESTARTED) != 0)
    note_up(can);
}

/* When the kernel received it, and how many it has dropped since. */
static void read_control(socketcan *can, struct msghdr *message, double *t_s) {
  for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c != NULL; c = CMSG_NXTHDR(message, c)) {
    if (c->cmsg_level != SOL_SOCKET)
      continue;
    if (c->cmsg_type == SO_TIMESTAMPNS) {
      struct timespec stamp;
      memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
      *t_s = (double)stamp.tv_sec + 1e-9 * (double)stamp.tv_nsec;
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      uint32_t total;
      memcpy(&total, CMSG_DATA(c), sizeof total);
      const uint32_t more = total - can->overflow;
      can->overflow = total;
      can->counts.lost =
          more > UINT32_MAX - can->counts.lost ? UINT32_MAX : can->counts.lost + more;
    }
  }
}

static int receive_failed(socketcan *can) {
  switch (errno) {
  case EAGAIN:
    return 0;
  case ENETDOWN: /* told once; the same socket works when the interface is up again */
    note_down(can);
    return -1;
  case ENODEV:
  case ENXIO:
    let_go(can);
    return 0;
  default:
    return -1;
  }
}

int socketcan_receive(socketcan *can, rim_can_frame *frame, double *t_s) {
  struct canfd_frame in;
  _Alignas(struct cmsghdr) char control[128];
  if (can->fd < 0)
    return 0;
  memset(&in, 0, sizeof in);
  struct iovec part = {&in, sizeof in};
  struct msghdr received = {
      .msg_iov = &part, .msg_iovlen = 1, .msg_control = control, .msg_controllen = sizeof control};
  const ssize_t bytes = recvmsg(can->fd, &received, MSG_DONTWAIT);
  if (bytes < 0)
    return receive_failed(can);
  *t_s = 0.0;
  read_control(can, &received, t_s);
  if ((in.can_id & CAN_ERR_FLAG) != 0) {
    take_error(can, in.can_id);
    return -1;
  }
  note_up(can); /* something comes in: up and on the bus */
  const bool is_fd = bytes == CANFD_MTU;
  if ((!is_fd && bytes != CAN_MTU) || in.len > (is_fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN) ||
      (in.can_id & CAN_RTR_FLAG) != 0) {
    count(&can->counts.refused);
    return -1;
  }
  count(&can->counts.frames);
  memset(frame, 0, sizeof *frame);
  frame->id = in.can_id;
  frame->length = in.len;
  frame->fd = is_fd;
  memcpy(frame->data, in.data, in.len);
  return 1;
}
