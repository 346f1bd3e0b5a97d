/* SPDX-License-Identifier: MIT */
/* rimd: the monitor as a Linux daemon. See firmware/README.md and rimd.conf. */
#define _GNU_SOURCE
#include <errno.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>

#include "rim/version.h"
#include "rimd/rimd.h"
#include "rimd/say.h"

enum { EXIT_FINE = 0, EXIT_USAGE = 2, EXIT_DATA = 3 };

#define STACK_BYTES 65536 /* touched once, so that no page is fetched later */

static rimd instance;
static volatile sig_atomic_t stopped;

static void stop(int signal) { stopped = signal; }

static const char usage[] =
    "usage: rimd [--check] [--state FILE] CONFIG\n"
    "The monitor between LCM and CAN: observations in, alarms and health out. It stays in the\n"
    "foreground, says 'rimd: ready' on stderr, and ends on SIGTERM or SIGINT.\n"
    "  --check       read and check everything, open nothing, print sizes\n"
    "  --state FILE  the state that survives a restart (as `state` in CONFIG)\n"
    "  --version     print the version\n"
    "Exit status: 0 stopped, 2 usage, 3 data, configuration or system, 4 memory is damaged and\n"
    "on_damage = restart.\n"
    "Example:\n"
    "  printf 'image = lander.rim\\nlcm = udpm://239.255.76.67:7667?ttl=0\\n' > rimd.conf\n"
    "  rimd --state /var/lib/rimd/state rimd.conf\n";

/* Signals are held back except while the daemon waits for input: none is lost, none interrupts. */
static void catch_signals(void) {
  struct sigaction action;
  sigset_t held;
  memset(&action, 0, sizeof action);
  action.sa_handler = stop;
  sigemptyset(&held);
  sigaddset(&held, SIGTERM);
  sigaddset(&held, SIGINT);
  sigprocmask(SIG_BLOCK, &held, NULL);
  sigaction(SIGTERM, &action, NULL);
  sigaction(SIGINT, &action, NULL);
  action.sa_handler = SIG_IGN;
  sigaction(SIGHUP, &action, NULL);
  sigaction(SIGPIPE, &action, NULL);
}

static void touch_stack(void) {
  volatile char stack[STACK_BYTES];
  for (size_t i = 0; i < sizeof stack; i += 1024)
    stack[i] = 0;
}

static int be_real_time(const config *c) {
  if (c->mlock) {
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
      say("mlock: %s (CAP_IPC_LOCK, or a larger limit of locked memory, is needed)",
          strerror(errno));
      return EXIT_DATA;
    }
    touch_stack();
  }
  const struct sched_param priority = {.sched_priority = (int)c->fifo_priority};
  if (c->fifo_priority > 0 && sched_setscheduler(0, SCHED_FIFO, &priority) != 0) {
    say("fifo_priority: %s (CAP_SYS_NICE is needed)", strerror(errno));
    return EXIT_DATA;
  }
  return EXIT_FINE;
}

static void print_sizes(const rimd *d) {
  printf("model %u: %u features, %u outcomes, %u values a row%s\n", d->view.model_id, d->features,
         d->outcomes, d->values, d->external ? " with their predictions" : "");
  printf("bytes: image %zu, monitor %zu, everything else %zu\n", d->image_bytes, d->memory_bytes,
         sizeof *d);
}

/* The argument after option i; NULL after saying that there is none. */
static const char *argument_of(int argc, char **argv, int *i) {
  if (*i + 1 < argc)
    return argv[++*i];
  say("%s needs an argument", argv[*i]);
  return NULL;
}

/* -1: go on; else the exit status. */
static int read_arguments(int argc, char **argv, const char **path, const char **state,
                          bool *check) {
  for (int i = 1; i < argc; ++i) {
    if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
      fputs(usage, stdout);
      return EXIT_FINE;
    }
    if (strcmp(argv[i], "--version") == 0) {
      printf("rimd %d.%d.%d\n", RIM_VERSION_MAJOR, RIM_VERSION_MINOR, RIM_VERSION_PATCH);
      return EXIT_FINE;
    }
    if (strcmp(argv[i], "--check") == 0) {
      *check = true;
    } else if (strcmp(argv[i], "--state") == 0) {
      *state = argument_of(argc, argv, &i);
      if (*state == NULL)
        return EXIT_USAGE;
    } else if (argv[i][0] == '-' || *path != NULL) {
      say("%s '%s'; rimd --help", argv[i][0] == '-' ? "unknown option" : "one file too many",
          argv[i]);
      return EXIT_USAGE;
    } else {
      *path = argv[i];
    }
  }
  if (*path != NULL)
    return -1;
  fputs(usage, stderr);
  return EXIT_USAGE;
}

int main(int argc, char **argv) {
  const char *path = NULL, *state = NULL;
  bool check = false;
  int status = read_arguments(argc, argv, &path, &state, &check);
  if (status >= 0)
    return status;
  config *c = &instance.config;
  if (state != NULL && (strlen(state) >= sizeof c->state || state[0] == '\0')) {
    say("--state: a name of 1 to %zu characters is needed", sizeof c->state - 1);
    return EXIT_USAGE;
  }
  if (config_read(c, path, state) != 0)
    return EXIT_DATA;
  if (check) {
    status = rimd_check(&instance);
    if (status == EXIT_FINE)
      print_sizes(&instance);
    return status;
  }
  catch_signals();
  status = rimd_start(&instance);
  if (status == EXIT_FINE)
    status = be_real_time(c);
  if (status != EXIT_FINE)
    return status;
  say("ready: model %u, %u values a row", instance.view.model_id, instance.values);
  rimd_run(&instance, &stopped);
  status = rimd_finish(&instance);
  const char *why = instance.ending     ? "on_damage = restart"
                    : stopped == SIGINT ? "SIGINT"
                                        : "SIGTERM";
  say("stopped by %s after %u observations and %u alarm records", why, instance.kept.counters.rows,
      rim_monitor_alarms(instance.monitor).records);
  rimd_tell_counts(&instance.kept);
  return status;
}
