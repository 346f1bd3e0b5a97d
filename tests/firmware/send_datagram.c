/* SPDX-License-Identifier: MIT */
/* send_datagram FILE ADDRESS PORT: the bytes of FILE as one UDP datagram to a multicast group, by
 * the loopback interface. For the guest, which has neither Python nor netcat for UDP. */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>

int main(int argc, char **argv) {
  static char bytes[65536];
  FILE *file = argc == 4 ? fopen(argv[1], "rb") : NULL;
  if (file == NULL)
    return 2;
  const size_t count = fread(bytes, 1, sizeof bytes, file);
  fclose(file);
  const struct ip_mreqn interface = {.imr_address.s_addr = htonl(INADDR_LOOPBACK)};
  struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((unsigned short)atoi(argv[3]))};
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  if (inet_pton(AF_INET, argv[2], &to.sin_addr) != 1 ||
      setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface) != 0 ||
      sendto(fd, bytes, count, 0, (const struct sockaddr *)&to, sizeof to) != (ssize_t)count) {
    perror(argv[2]);
    return 1;
  }
  return 0;
}
