// SPDX-License-Identifier: MIT
// uORB.
#pragma once
#include <px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp>
#include <uORB/Subscription.hpp>
namespace uORB {
class SubscriptionCallbackWorkItem : public Subscription {
public:
  SubscriptionCallbackWorkItem(px4::ScheduledWorkItem *work_item, const orb_metadata *meta,
                               uint8_t instance = 0);
  bool registerCallback();
  void unregisterCallback();
};
} // namespace uORB
