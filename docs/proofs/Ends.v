(* Service ends: where no crossed set of places has more residents than its slots less two, there is no endless run of the
   service rule in which the served head does not move. With `service_goes_on` it moves after finitely many moves. *)
Require Import Model Chain Crowd Service.

Section Ends.
Context `{R : roads}.
Hypothesis wide : forall p, 2 <= slots p.
Variable places : nat.
Hypothesis all_places : forall s, place s < places.
Variable spots : list spot.
Hypothesis all_spots : forall s, In s spots.
Hypothesis spot_eq : forall s t : spot, {s = t} + {s <> t}.

Fixpoint far (k : nat) (s : spot) : spot := match k with 0 => s | S j => far j (next s) end.
Hypothesis closed : forall s, exists k, far (S k) s = s.

(* the loop of s has places in Q and outside *)
Definition crosses (Q : list nat) s := (exists k, In (place (far k s)) Q) /\ exists k, ~ In (place (far k s)) Q.

(* (S) *)
Definition uncrowded (D : config) := forall Q (resident : spot -> bool), NoDup Q ->
  (forall s, resident (next s) = resident s) -> (forall s, resident s = true -> In (place s) Q) ->
  (exists p s, In s (D p) /\ crosses Q s) -> residents Q resident D + 2 <= sum slots Q.

Lemma uncrowded_stays p D E : possible D -> uncrowded D -> move p D E -> uncrowded E.
Proof.
  intros P U M Q resident N St In_ (x & s & I & C). rewrite (residents_stay Q N resident St In_ p D E P M).
  apply U; auto. destruct M as (t & line & Dp & Room & Ep & Eq & Rest).
  destruct (Nat.eq_dec x p) as [->|Np]; [rewrite Ep in I; exists p, s; rewrite Dp; split; [right|]; auto|].
  destruct (Nat.eq_dec x (place (next t))) as [->|Nq]; [|rewrite Rest in I; eauto].
  rewrite Eq in I. apply in_app_or in I. destruct I as [I|[<-|[]]]; [eauto|].
  exists p, t. rewrite Dp. split; [left; auto|]. destruct C as [[k A] [j B]].
  split; [exists (S k)|exists (S j)]; auto.
Qed.

(* (S) is free where every place has a slot free *)
Theorem roomy_is_uncrowded D : possible D -> (forall p, ~ full D p) -> uncrowded D.
Proof.
  intros P N Q f ND St In_ (x & s & _ & [[k Ik] _]). unfold residents.
  destruct (classic (exists t, f t = true)) as [[t Ft]|No].
  - assert (Two : 2 <= length Q).
    { assert (L : NoDup [place (next t); place t]).
      { constructor; [intros [E|[]]; symmetry in E; revert E; apply no_self|constructor; [intros []|constructor]]. }
      apply (NoDup_incl_length L). intros r [<-|[<-|[]]]; apply In_; auto. rewrite St. auto. }
    assert (Le : sum (fun r => count f true (D r) + 1) Q <= sum slots Q).
    { apply sum_le. intros r _. assert (A := count_all f (D r)). destruct (P r) as [L _]. specialize (N r). unfold full in N. lia. }
    rewrite sum_add in Le. assert (One : sum (fun _ => 1) Q = length Q); [|lia].
    clear. unfold sum. induction Q; simpl; auto.
  - assert (Z : sum (fun r => count f true (D r)) Q <= sum (fun _ => 0) Q).
    { apply sum_le. intros r _. unfold count. assert (E : filter (fun t => Bool.eqb (f t) true) (D r) = []); [|rewrite E; auto].
      induction (D r) as [|t l IH]; simpl; auto. destruct (f t) eqn:Ft; [exfalso; apply No; eauto|auto]. }
    assert (Zero : sum (fun _ => 0) Q = 0) by (clear; unfold sum; induction Q; simpl; auto).
    rewrite (sum_of slots Q _ ND Ik). specialize (wide (place (far k s))). lia.
Qed.

Section Run.
Variable p : nat.
Variable X : nat -> config.
Variable m : nat -> nat.
Hypothesis begins : possible (X 0) /\ ~ jammed (X 0) /\ uncrowded (X 0).
Hypothesis runs : forall i, serve p (X i) (X (S i)) (m i).
Hypothesis waits : forall i, m i <> p.

Lemma always i : possible (X i) /\ ~ jammed (X i) /\ uncrowded (X i).
Proof.
  induction i as [|i (P & N & U)]; auto. destruct (serve_target p _ _ _ P (runs i)) as (h & _ & _ & M & NJ & _).
  split; [eapply move_possible; eauto|split; auto]. eapply uncrowded_stays; eauto.
Qed.

Lemma moves i : move (m i) (X i) (X (S i)) /\ full (X i) (m i).
Proof.
  destruct (always i) as (P & _). destruct (serve_target p _ _ _ P (runs i)) as (h & _ & _ & M & _ & F & _).
  split; auto. destruct F as [F|F]; auto. destruct (waits i). auto.
Qed.

Lemma into_last_hole i : wants (X (S i)) (m (S i)) (m i) /\ ~ full (X (S i)) (m i) /\ exists z, ends_at (X (S i)) p z (m i).
Proof.
  destruct (always i) as (P & N & _). destruct (always (S i)) as (P2 & _).
  destruct (serve_target p _ _ _ P (runs i)) as (h & W & _).
  destruct (next_hole wide p _ _ _ h P N (runs i) (waits i) W) as (y & Ey).
  destruct (serve_target p _ _ _ P2 (runs (S i))) as (h2 & W2 & _ & _ & _ & _ & z & Ez).
  destruct (one_end _ _ _ _ _ _ Ey Ez) as [_ ->]. split; auto. split; [apply Ez|eauto].
Qed.

(* how a move changes lines *)
Lemma line_after i r : (r = m i /\ exists s, X i r = s :: X (S i) r /\ place s = r) \/
  (r <> m i /\ (X (S i) r = X i r \/ exists s, X (S i) r = X i r ++ [s] /\ ~ full (X i) r)).
Proof.
  destruct (moves i) as [(s & line & Dm & Room & Em & Eq & Rest) _]. destruct (always i) as (P & _).
  destruct (Nat.eq_dec r (m i)) as [->|Nm].
  - left. split; auto. exists s. rewrite Dm, Em. split; auto. apply (P (m i)). rewrite Dm. left. auto.
  - right. split; auto. destruct (Nat.eq_dec r (place (next s))) as [->|Nq]; [right; eauto|left; auto].
Qed.

Definition again r := forall n, exists i, n <= i /\ m i = r.

Lemma settles : exists T, forall i, T <= i -> again (m i).
Proof.
  assert (H : forall k, exists T, forall i, T <= i -> m i < k -> again (m i)).
  { induction k as [|k [T H]]; [exists 0; intros; lia|]. destruct (classic (again k)) as [A|N].
    - exists T. intros i L M. destruct (Nat.eq_dec (m i) k) as [->|]; auto. apply H; auto. lia.
    - apply not_all_ex_not in N. destruct N as [n N]. exists (T + n). intros i L M.
      destruct (Nat.eq_dec (m i) k) as [E|]; [|apply H; lia]. exfalso. apply N. exists i. split; auto. lia. }
  destruct (H places) as [T Ht]. exists T. intros i L. apply Ht; auto.
  destruct (line_after i (m i)) as [(_ & s & _ & <-)|[N _]]; [apply all_places|contradiction].
Qed.

Lemma listed : exists Q, NoDup Q /\ forall r, In r Q <-> again r.
Proof.
  assert (H : forall k, exists Q, NoDup Q /\ forall r, In r Q <-> r < k /\ again r).
  { induction k as [|k (Q & N & H)]; [exists []; split; [constructor|]; intro; simpl; lia|].
    destruct (classic (again k)) as [A|NA].
    - exists (k :: Q). split; [constructor; auto; rewrite H; lia|]. intro r. simpl. rewrite H.
      split; [intros [<-|[L B]]; split; auto; lia|]. intros [L B]. destruct (Nat.eq_dec k r); auto. right. split; auto. lia.
    - exists Q. split; auto. intro r. rewrite H. split; intros [L B]; (split; [|exact B]); [lia|].
      destruct (Nat.eq_dec r k); [subst; contradiction|lia]. }
  destruct (H places) as (Q & N & HQ). exists Q. split; auto. intro r. rewrite HQ. split; [tauto|]. intro A. split; auto.
  destruct (A 0) as (i & _ & <-). destruct (line_after i (m i)) as [(_ & s & _ & <-)|[Nm _]]; [apply all_places|contradiction].
Qed.

(* a place that moves again and again is full, but for the moment after its own move *)
Definition nearly i r := full (X (S i)) r \/ (r = m i /\ length (X (S i) r) + 1 = slots r).

Lemma nearly_full r : again r -> exists n, forall i, n <= i -> nearly i r.
Proof.
  intro A. destruct (A 0) as (n & _ & E). exists n. intros i L. induction L as [|i L IH].
  - right. split; auto. destruct (moves n) as [_ F]. rewrite E in F.
    destruct (line_after n r) as [(_ & s & H & _)|[N _]]; [|congruence]. unfold full in F. rewrite H in F. simpl in F. lia.
  - destruct (into_last_hole i) as (W & NF & _). destruct IH as [F|[-> Len]].
    + destruct (line_after (S i) r) as [(Em & s & H & _)|[Nm [H|(s & H & Nf)]]].
      * right. split; auto. unfold full in F. rewrite H in F. simpl in F. lia.
      * left. unfold full in *. rewrite H. auto.
      * contradiction.
    + left. destruct (moves (S i)) as [(s & line & Dm & Room & Em & Eq & Rest) _].
      assert (T : m i = place (next s)).
      { destruct W as (t & H & <-). unfold head in H. rewrite Dm in H. injection H as ->. auto. }
      unfold full. rewrite T in *. rewrite Eq, app_length. simpl. lia.
Qed.

Lemma all_nearly_full Q : (forall r, In r Q -> again r) -> exists n, forall i r, n <= i -> In r Q -> nearly i r.
Proof.
  induction Q as [|a Q IH]; intro H; [exists 0; intros i r _ []|].
  destruct IH as [n Hn]; [intros; apply H; right; auto|]. destruct (nearly_full a) as [k Hk]; [apply H; left; auto|].
  exists (n + k). intros i r L [<-|I]; [apply Hk; lia|apply Hn; auto; lia].
Qed.

(* who stands in such a place gets to its head and moves *)
Lemma comes r s : again r -> forall a t b, X t r = a ++ s :: b -> exists u, t <= u /\ m u = r /\ head (X u) r = Some s.
Proof.
  intro A. induction a as [|c a IH]; intros t b E.
  - assert (Md : exists d, m (t + d) = r) by (destruct (A t) as (i & L & M); exists (i - t); rewrite <- M; f_equal; lia).
    destruct Md as [d M]. revert t b E M.
    induction d as [|d IHd]; intros t b E M.
    + exists t. rewrite Nat.add_0_r in M. split; auto. split; auto. unfold head. rewrite E. auto.
    + destruct (line_after t r) as [(Em & x & H & _)|[Nm [H|(x & H & _)]]].
      * exists t. split; auto. split; auto. unfold head. rewrite E. auto.
      * destruct (IHd (S t) b) as (u & L & U); [rewrite H; auto|rewrite <- M; f_equal; lia|]. exists u. split; auto; lia.
      * destruct (IHd (S t) (b ++ [x])) as (u & L & U); [rewrite H, E; auto|rewrite <- M; f_equal; lia|]. exists u. split; auto; lia.
  - assert (Md : exists d, m (t + d) = r) by (destruct (A t) as (i & L & M); exists (i - t); rewrite <- M; f_equal; lia).
    destruct Md as [d M]. revert t b E M.
    induction d as [|d IHd]; intros t b E M.
    + rewrite Nat.add_0_r in M. destruct (line_after t r) as [(_ & x & H & _)|[Nm _]]; [|congruence].
      rewrite E in H. injection H as _ H. destruct (IH (S t) b) as (u & L & U); auto. exists u. split; auto; lia.
    + destruct (line_after t r) as [(Em & x & H & _)|[Nm [H|(x & H & _)]]].
      * rewrite E in H. injection H as _ H. destruct (IH (S t) b) as (u & L & U); auto. exists u. split; auto; lia.
      * destruct (IHd (S t) b) as (u & L & U); [rewrite H; auto|rewrite <- M; f_equal; lia|]. exists u. split; auto; lia.
      * destruct (IHd (S t) (b ++ [x])) as (u & L & U); [rewrite H, E, <- app_assoc; auto|rewrite <- M; f_equal; lia|].
        exists u. split; auto; lia.
Qed.

Lemma are_residents T : (forall i, T <= i -> again (m i)) ->
  forall k t r s, S T <= t -> again r -> In s (X t r) -> again (place (far k s)).
Proof.
  intro HT. induction k as [|k IH]; intros t r s L A I; simpl.
  - destruct (always t) as (P & _). destruct (P r) as [_ H]. rewrite (H s I). auto.
  - apply in_split in I. destruct I as (a & b & E). destruct (comes r s A a t b E) as (u & Lu & Mu & Hu).
    destruct u as [|u]; [lia|]. destruct (into_last_hole u) as (W & _).
    destruct (moves (S u)) as [(v & line & Dm & Room & Em & Eq & Rest) _].
    assert (v = s) by (unfold head in Hu; rewrite <- Mu, Dm in Hu; simpl in Hu; congruence). subst v.
    assert (Q : place (next s) = m u) by (apply (wants_one (X (S u)) (m (S u))); auto; exists s; unfold head; rewrite Dm; auto).
    apply (IH (S (S u)) (place (next s))); [lia|rewrite Q; apply HT; lia|]. rewrite Eq. apply in_or_app. right. left. auto.
Qed.

Lemma decided (A : spot -> Prop) : exists f, forall s, f s = true <-> A s.
Proof.
  assert (H : forall l, exists f, forall s, In s l -> (f s = true <-> A s)).
  { induction l as [|a l [f H]]; [exists (fun _ => true); intros s []|].
    destruct (classic (A a)) as [Y|N]; [exists (fun s => if spot_eq s a then true else f s)|exists (fun s => if spot_eq s a then false else f s)];
      intros s [<-|I]; destruct (spot_eq _ _) as [E|E]; try subst; try tauto; try (split; [discriminate|contradiction]); auto. }
  destruct (H spots) as [f Hf]. exists f. auto.
Qed.

Lemma only_one q l : NoDup l -> sum (fun r => if Nat.eq_dec r q then 1 else 0) l <= 1.
Proof.
  unfold sum. induction l as [|a l IH]; intro N; simpl; [lia|]. inversion N; subst. specialize (IH H2).
  destruct (Nat.eq_dec a q) as [->|]; [|lia]. assert (Z : list_sum (map (fun r => if Nat.eq_dec r q then 1 else 0) l) = 0); [|lia].
  clear - H1. induction l as [|b l IH]; simpl; auto. destruct (Nat.eq_dec b q); [subst; exfalso; apply H1; left; auto|].
  apply IH. intro. apply H1. right. auto.
Qed.

Lemma way_in D Q z : chain D p z -> ~ In p Q -> In z Q -> exists x y, ~ In x Q /\ In y Q /\ wants D x y.
Proof.
  induction 1 as [|r x C IH W F]; intros Np I; [contradiction|]. destruct (classic (In r Q)); auto. eauto.
Qed.

Theorem no_endless_service : False.
Proof.
  destruct settles as [T HT]. destruct listed as (Q & N & HQ). destruct (all_nearly_full Q) as [n Hn]; [apply HQ|].
  set (i := T + n + 1). destruct (decided (fun s => forall k, In (place (far k s)) Q)) as [f Hf].
  assert (Np : ~ In p Q) by (intro I; apply HQ in I; destruct (I 0) as (j & _ & E); apply (waits j); auto).
  destruct (always (S i)) as (P & _ & U). destruct (into_last_hole i) as (_ & _ & z & C & W & _).
  assert (Iq : In (m i) Q) by (apply HQ, HT; unfold i; lia).
  assert (Cross : exists x y, ~ In x Q /\ In y Q /\ wants (X (S i)) x y).
  { destruct (classic (In z Q)) as [Iz|Nz]; [eapply way_in; eauto|]. exists z, (m i). auto. }
  destruct Cross as (x & y & Nx & Iy & s & Hs & Es).
  assert (Sx : In s (X (S i) x)) by (unfold head in Hs; destruct (X (S i) x); [discriminate|injection Hs as ->; left; auto]).
  assert (Px : place s = x) by (apply (P x); auto).
  assert (Le : residents Q f (X (S i)) + 2 <= sum slots Q).
  { apply U; auto.
    - intro t. destruct (f t) eqn:E1, (f (next t)) eqn:E2; auto; exfalso.
      + assert (E : f (next t) = true); [|congruence]. apply Hf. intro k. apply (proj1 (Hf t) E1 (S k)).
      + assert (E : f t = true); [|congruence]. apply Hf. intros [|k]; [|apply (proj1 (Hf (next t)) E2 k)].
        destruct (closed t) as [k E]. simpl. rewrite <- E. apply (proj1 (Hf (next t)) E2 k).
    - intros t E. apply (proj1 (Hf t) E 0).
    - exists x, s. split; auto. split; [exists 1|exists 0]; simpl; congruence. }
  assert (Eq : residents Q f (X (S i)) = sum (fun r => length (X (S i) r)) Q).
  { apply sum_ext. intros r I. rewrite (count_all f). assert (Z : count f false (X (S i) r) = 0); [|lia].
    unfold count. apply length_zero_iff_nil.
    assert (All : forall t, In t (X (S i) r) -> f t = true).
    { intros t It. apply Hf. intro k. apply HQ. apply (are_residents T HT k (S i) r); auto; [unfold i; lia|apply HQ; auto]. }
    induction (X (S i) r) as [|t l IH]; simpl; auto. rewrite (All t) by (left; auto). simpl. apply IH. intros. apply All. right. auto. }
  assert (Ge : sum slots Q <= sum (fun r => length (X (S i) r) + (if Nat.eq_dec r (m i) then 1 else 0)) Q).
  { apply sum_le. intros r I. destruct (Hn i r) as [F|[-> L]]; auto; [unfold i; lia| |].
    - unfold full in F. lia.
    - destruct (Nat.eq_dec (m i) (m i)); [lia|contradiction]. }
  rewrite sum_add in Ge. assert (One := only_one (m i) Q N). lia.
Qed.
End Run.
End Ends.
Print Assumptions uncrowded_stays.
Print Assumptions roomy_is_uncrowded.
Print Assumptions no_endless_service.
